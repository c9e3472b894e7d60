# Targets that judge the source: cppcheck and tidy (clang-tidy), both of them by lint, in which no finding is allowed, and coverage (of a
# build with BS_COVERAGE, after the tests have run). What is not asked for stands with its reason in .clang-tidy and .cppcheck.
find_program(BS_CLANG_TIDY NAMES clang-tidy clang-tidy-14)
find_program(BS_RUN_CLANG_TIDY NAMES run-clang-tidy run-clang-tidy-14)
find_program(BS_CPPCHECK cppcheck)
find_program(BS_CLANG_FORMAT NAMES clang-format clang-format-14)
find_program(BS_GCOVR gcovr)

# Without its tools a target says what to install.
foreach(tool BS_CLANG_TIDY BS_RUN_CLANG_TIDY BS_CPPCHECK BS_CLANG_FORMAT BS_GCOVR)
  if(NOT ${tool})
    set(${tool} ${CMAKE_COMMAND} -E false "apt install clang-format clang-tidy cppcheck gcovr")
  endif()
endforeach()

# The fuzzers are a project of their own, which the compilation database does not know.
file(GLOB BS_LINTED_ALONE CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/tests/fuzz/*.cpp ${CMAKE_SOURCE_DIR}/tests/sanitize/*.cpp)
cmake_host_system_information(RESULT BS_CORES QUERY NUMBER_OF_LOGICAL_CORES)
file(GLOB_RECURSE BS_FORMATTED CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/src/*.cpp ${CMAKE_SOURCE_DIR}/src/*.hpp ${CMAKE_SOURCE_DIR}/src/*.cxx
     ${CMAKE_SOURCE_DIR}/tests/*.cpp ${CMAKE_SOURCE_DIR}/tests/*.hpp)
add_custom_target(format VERBATIM COMMAND ${BS_CLANG_FORMAT} -i ${BS_FORMATTED} COMMENT "clang-format")
if(BS_TESTS)
  add_test(NAME format COMMAND ${BS_CLANG_FORMAT} --dry-run --Werror ${BS_FORMATTED})
  set_tests_properties(format PROPERTIES TIMEOUT 120 LABELS lint)
endif()

add_custom_target(cppcheck VERBATIM
  COMMAND ${BS_CPPCHECK} -j ${BS_CORES} --enable=warning,performance,portability,style --std=c++17 --language=c++ --quiet --error-exitcode=1
          --suppressions-list=${CMAKE_SOURCE_DIR}/.cppcheck -I${CMAKE_SOURCE_DIR}/src
          "--template={file}:{line}: {id}: {message}" ${CMAKE_SOURCE_DIR}/src ${CMAKE_SOURCE_DIR}/tests
  COMMENT "cppcheck: some minutes")

# clang-tidy cannot read the headers that g++ has precompiled, and finds includes that they hide.
set(BS_TIDIED "(src|tests)/.*[.]cpp$" CACHE STRING "regular expression of the files that the target tidy reads, below the source folder")
add_custom_target(tidy VERBATIM
  COMMAND ${BS_CLANG_TIDY} --quiet ${BS_LINTED_ALONE} -- -std=c++17 -I${CMAKE_SOURCE_DIR}/src
  COMMAND ${CMAKE_COMMAND} -S ${CMAKE_SOURCE_DIR} -B ${CMAKE_BINARY_DIR}/lint -G Ninja -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON
          -DBS_PETSC_MODULE=${BS_PETSC_MODULE} -DBS_SLEPC_MODULE=${BS_SLEPC_MODULE} -DPETSC_DIR=${PETSC_DIR} -DPETSC_ARCH=${PETSC_ARCH} -DSLEPC_DIR=${SLEPC_DIR}
  COMMAND ${BS_RUN_CLANG_TIDY} -quiet -j ${BS_CORES} -p ${CMAKE_BINARY_DIR}/lint "${CMAKE_SOURCE_DIR}/${BS_TIDIED}"
  COMMENT "clang-tidy: some minutes")

add_custom_target(lint VERBATIM COMMAND ${BS_CLANG_FORMAT} --dry-run --Werror ${BS_FORMATTED} COMMENT "clang-format")
add_dependencies(lint cppcheck tidy)

add_custom_target(coverage VERBATIM
  COMMAND ${BS_GCOVR} --root ${CMAKE_SOURCE_DIR} --object-directory ${CMAKE_BINARY_DIR} --filter ${CMAKE_SOURCE_DIR}/src/
          --exclude-unreachable-branches --sort-uncovered --print-summary --fail-under-line 90
  COMMENT "gcovr: lines of src/ that the tests run")
