# If WHAT is WholeBuild: installs BUILD into an empty prefix, and compiles every installed header. If WHAT is
# RendererAlone: builds and installs only the renderer, without pugixml and torch. Then builds and runs the consumer.
function(run)
  execute_process(COMMAND ${ARGV} COMMAND_ERROR_IS_FATAL ANY)
endfunction()
set(compiler -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER})
# build(SOURCE NAME [options...])
function(build source name)
  run(${CMAKE_COMMAND} -G Ninja -S ${source} -B ${SCRATCH}/${name} ${compiler} ${ARGN})
  run(${CMAKE_COMMAND} --build ${SCRATCH}/${name} -j 2)
endfunction()

file(REMOVE_RECURSE ${SCRATCH})
set(prefix ${SCRATCH}/prefix)
if(WHAT STREQUAL WholeBuild)
  run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix})
  build(${CMAKE_CURRENT_LIST_DIR}/all_headers all_headers -DCMAKE_PREFIX_PATH=${prefix})
else()
  # Without optimization and in groups, because the build of BUILD has compiled these sources as they are shipped.
  build(${SOURCE} renderer -DCMAKE_UNITY_BUILD=ON "-DCMAKE_CXX_FLAGS_RELEASE=-O0 -DNDEBUG" -DPICTURA_ONLY_RENDERER=ON -DPICTURA_WITH_CUDA=OFF -DPICTURA_WITH_GL=OFF
        -DCMAKE_DISABLE_FIND_PACKAGE_pugixml=ON -DPICTURA_VENV=${SCRATCH}/none)
  run(${CMAKE_COMMAND} --install ${SCRATCH}/renderer --prefix ${prefix} --component renderer)
endif()

file(GLOB_RECURSE exported ${prefix}/*pictura-*.cmake)
if(NOT exported)
  message(FATAL_ERROR "${prefix}: no exported targets are installed")
endif()
foreach(file ${exported})
  file(STRINGS ${file} forced REGEX "-W|-march|-O[0-9]|-fsanitize")
  if(forced)
    message(FATAL_ERROR "${file}: forces flags of this build onto its users: ${forced}")
  endif()
endforeach()

build(${CMAKE_CURRENT_LIST_DIR}/consumer consumer -DCMAKE_PREFIX_PATH=${prefix} -DCMAKE_DISABLE_FIND_PACKAGE_pugixml=ON)
execute_process(COMMAND ${SCRATCH}/consumer/car WORKING_DIRECTORY ${SCRATCH} COMMAND_ERROR_IS_FATAL ANY)
file(SIZE ${SCRATCH}/car.png bytes)
if(bytes LESS 4000)
  message(FATAL_ERROR "${SCRATCH}/car.png: expected a picture with a car and two lines, got ${bytes} bytes")
endif()

# The error message must name a component that is not installed.
file(MAKE_DIRECTORY ${SCRATCH}/asks)
file(WRITE ${SCRATCH}/asks/CMakeLists.txt "cmake_minimum_required(VERSION 3.25)
project(asks LANGUAGES CXX)
find_package(pictura REQUIRED COMPONENTS painter)
")
execute_process(COMMAND ${CMAKE_COMMAND} -G Ninja -S ${SCRATCH}/asks -B ${SCRATCH}/asks/build ${compiler}
                        -DCMAKE_PREFIX_PATH=${prefix} ERROR_VARIABLE refusal OUTPUT_QUIET RESULT_VARIABLE status)
if(status EQUAL 0 OR NOT refusal MATCHES "'painter'")
  message(FATAL_ERROR "find_package(pictura COMPONENTS painter): expected a refusal that names it, got: ${refusal}")
endif()
