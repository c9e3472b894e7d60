# cmake --install, the CMake package and cpack's .deb: PREFIX/bin, PREFIX/share/backspring, man page, documents;
# component devel: the core library with its headers; component python (src/python): the Python package.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(BS_SHARE ${CMAKE_INSTALL_DATADIR}/backspring)
set(BS_PACKAGE ${CMAKE_INSTALL_LIBDIR}/cmake/backspring)

# An installed program looks into ../share/backspring, a built one into share/backspring beside it (base/find_file).
file(MAKE_DIRECTORY ${CMAKE_BINARY_DIR}/share/backspring ${CMAKE_BINARY_DIR}/links)
foreach(folder options meshes postprocess)
  file(CREATE_LINK ${CMAKE_SOURCE_DIR}/${folder} ${CMAKE_BINARY_DIR}/share/backspring/${folder} SYMBOLIC)
  install(DIRECTORY ${CMAKE_SOURCE_DIR}/${folder} DESTINATION ${BS_SHARE} COMPONENT runtime USE_SOURCE_PERMISSIONS
          PATTERN __pycache__ EXCLUDE PATTERN gallery EXCLUDE PATTERN backspring.1 EXCLUDE PATTERN make_reference.py EXCLUDE)
endforeach()

install(TARGETS backspring RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT runtime)
# The tools as commands: backspring-plot for postprocess/plot.py
foreach(tool plot movie convert sweep compare)
  if(EXISTS ${CMAKE_SOURCE_DIR}/postprocess/${tool}.py)
    file(RELATIVE_PATH BS_LINK /${CMAKE_INSTALL_BINDIR} /${BS_SHARE}/postprocess/${tool}.py)
    file(CREATE_LINK ${BS_LINK} ${CMAKE_BINARY_DIR}/links/backspring-${tool} SYMBOLIC)
    install(FILES ${CMAKE_BINARY_DIR}/links/backspring-${tool} DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT runtime)
  endif()
endforeach()

execute_process(COMMAND gzip -9nc ${CMAKE_SOURCE_DIR}/options/reference/backspring.1
                OUTPUT_FILE ${CMAKE_BINARY_DIR}/backspring.1.gz COMMAND_ERROR_IS_FATAL ANY)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/options/reference/backspring.1)
install(FILES ${CMAKE_BINARY_DIR}/backspring.1.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT runtime)
install(FILES README.md CHANGELOG.md CITATION.cff DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT runtime)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT runtime RENAME copyright)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/backspring-dev COMPONENT devel RENAME copyright)

install(TARGETS backspring_core EXPORT backspring-targets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT devel
        INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} ${CMAKE_INSTALL_INCLUDEDIR}/backspring)
install(DIRECTORY src/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/backspring COMPONENT devel FILES_MATCHING PATTERN *.hpp
        PATTERN package EXCLUDE PATTERN cli EXCLUDE PATTERN python EXCLUDE)
set_target_properties(backspring_core PROPERTIES EXPORT_NAME core)
install(EXPORT backspring-targets NAMESPACE backspring:: DESTINATION ${BS_PACKAGE} COMPONENT devel)
configure_package_config_file(src/package/backspring-config.cmake.in ${CMAKE_BINARY_DIR}/backspring-config.cmake
                              INSTALL_DESTINATION ${BS_PACKAGE})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/backspring-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/backspring-config.cmake ${CMAKE_BINARY_DIR}/backspring-config-version.cmake
        DESTINATION ${BS_PACKAGE} COMPONENT devel)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_NAME backspring)
set(CPACK_PACKAGE_CONTACT "The backspring authors <backspring@invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_COMPONENTS_ALL runtime devel)
if(TARGET backspring_python)
  list(APPEND CPACK_COMPONENTS_ALL python)
endif()
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME backspring)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_DEPENDS openmpi-bin)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_RECOMMENDS
    "python3-h5py, python3-numpy, python3-scipy, python3-matplotlib, python3-pandas, python3-tqdm, python3-meshio, python3-yaml, ffmpeg")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SUGGESTS "paraview, python3-gsd, libopenblas0-serial")
set(CPACK_DEBIAN_DEVEL_PACKAGE_NAME backspring-dev)
set(CPACK_DEBIAN_DEVEL_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVEL_PACKAGE_DEPENDS "petsc-dev, slepc-dev, libopenmpi-dev, libhdf5-openmpi-dev, libyaml-dev, liblapack-dev, pkg-config")
set(CPACK_DEBIAN_DEVEL_DESCRIPTION "headers and static library of backspring, for find_package(backspring)")
set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-backspring)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= ${Python_VERSION_MAJOR}.${Python_VERSION_MINOR}), python3-numpy, python3-mpi4py")
set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS "backspring, python3-matplotlib, python3-h5py")
set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "python3-tqdm, python3-ase, jupyter-notebook")
set(CPACK_DEBIAN_PYTHON_DESCRIPTION "mass-spring networks as NumPy arrays: equilibria, modes, moduli and motions by backspring's implicit solver")
set(CPACK_OUTPUT_FILE_PREFIX ${CMAKE_BINARY_DIR}/packages)
include(CPack)
