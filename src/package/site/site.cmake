# The documents as static HTML with search: cmake --build build/release --target site writes build/release/site.
if(NOT TARGET backspring_python)
  return()  # its docstrings are part of the site
endif()
foreach(candidate $ENV{VIRTUAL_ENV}/bin/python3 python3 /usr/bin/python3)
  execute_process(COMMAND ${candidate} -c "import sphinx, myst_parser, furo, numpy, mpi4py" RESULT_VARIABLE lacks OUTPUT_QUIET ERROR_QUIET)
  if(lacks EQUAL 0)
    set(BS_SPHINX_PYTHON ${candidate})
    break()
  endif()
endforeach()
if(NOT BS_SPHINX_PYTHON)
  message(STATUS "the target site is left out: apt install python3-sphinx python3-myst-parser furo")
  return()
endif()
add_custom_target(site COMMAND ${BS_SPHINX_PYTHON} ${CMAKE_SOURCE_DIR}/src/package/site/make_site.py --program $<TARGET_FILE:backspring>
                  --python ${CMAKE_BINARY_DIR}/python --output ${CMAKE_BINARY_DIR}/site DEPENDS backspring backspring_python USES_TERMINAL)
# What was made of it goes with the Python package.
include(GNUInstallDirs)
install(DIRECTORY ${CMAKE_BINARY_DIR}/site/ DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/python3-backspring/html COMPONENT python OPTIONAL PATTERN .doctrees EXCLUDE)
