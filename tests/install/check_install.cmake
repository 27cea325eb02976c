# Installs the build in BUILD_DIR below a temporary prefix and builds, through find_package(Tellurion), a program that
# includes nothing, and every examples/<name>/ that has a CMakeLists.txt. Run with cmake -P by ctest.
cmake_minimum_required(VERSION 3.25)

set(work ${BUILD_DIR}/install_test)
set(prefix ${work}/prefix)
file(REMOVE_RECURSE ${work})

function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(result)
    string(REPLACE ";" " " command "${ARGV}")
    message(FATAL_ERROR "${command}\nfailed:\n${output}")
  endif()
endfunction()

run(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${prefix})

foreach(file share/tellurion/earth/world.toml share/tellurion/earth/elevation.tif)
  if(NOT EXISTS ${prefix}/${file})
    message(FATAL_ERROR "${file} is not installed")
  endif()
endforeach()

file(GLOB consumers ${SOURCE_DIR}/examples/*/CMakeLists.txt)
foreach(consumer ${SOURCE_DIR}/tests/install/CMakeLists.txt ${consumers})
  cmake_path(GET consumer PARENT_PATH folder)
  cmake_path(GET folder FILENAME name)
  set(flags "")
  if(SANITIZE)
    set(flags -DCMAKE_CXX_FLAGS=-fsanitize=${SANITIZE})
  endif()
  run(${CMAKE_COMMAND} -S ${folder} -B ${work}/${name} -G Ninja -DCMAKE_PREFIX_PATH=${prefix} -DCMAKE_BUILD_TYPE=Release
    -DCMAKE_CXX_COMPILER=${CXX_COMPILER} -DCMAKE_CXX_COMPILER_LAUNCHER=${CXX_COMPILER_LAUNCHER} ${flags})
  run(${CMAKE_COMMAND} --build ${work}/${name})
  message(STATUS "${name}: built through find_package")
endforeach()

# What is not there must not be found: a later minor version.
string(REGEX REPLACE "^([0-9]+)\\.([0-9]+).*$" "\\1" major ${VERSION})
string(REGEX REPLACE "^([0-9]+)\\.([0-9]+).*$" "\\2" minor ${VERSION})
math(EXPR later "${minor} + 1")
execute_process(
  COMMAND ${CMAKE_COMMAND} -S ${SOURCE_DIR}/tests/install -B ${work}/later -G Ninja -DCMAKE_PREFIX_PATH=${prefix}
    -DCMAKE_CXX_COMPILER=${CXX_COMPILER} -DWANTED_VERSION=${major}.${later}
  RESULT_VARIABLE result OUTPUT_QUIET ERROR_QUIET)
if(result EQUAL 0)
  message(FATAL_ERROR "find_package accepts version ${VERSION} where ${major}.${later} is wanted")
endif()
file(REMOVE_RECURSE ${work})
