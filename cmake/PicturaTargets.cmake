# Settings of all targets: flags of this build, include paths, precompiled headers, and tests with their environment.
# Headers are included as `pictura/FOLDER/FILE.h`, both in the source tree and when installed.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()

find_package(OpenMP REQUIRED)
find_package(fmt REQUIRED)

# Links <build>/include/pictura/FOLDER to each FOLDER, so that sources include headers by their installed names.
set(PICTURA_INCLUDE_DIR ${PROJECT_BINARY_DIR}/include)
file(MAKE_DIRECTORY ${PICTURA_INCLUDE_DIR}/pictura)
foreach(folder bindings common map simulator backend_cpu backend_cuda backend_gl backends configuration policy evaluation training drawing replay driving cli apps bench tests)
  file(CREATE_LINK ${PROJECT_SOURCE_DIR}/${folder} ${PICTURA_INCLUDE_DIR}/pictura/${folder} SYMBOLIC)
endforeach()
configure_file(${PROJECT_SOURCE_DIR}/common/version.h.in ${PICTURA_INCLUDE_DIR}/pictura/version.h @ONLY)

include(CheckCXXCompilerFlag)
check_cxx_compiler_flag(-Wdangling-reference PICTURA_HAS_WDANGLING_REFERENCE)
check_cxx_compiler_flag(-mno-fma PICTURA_HAS_MNO_FMA)

set(CMAKE_UNITY_BUILD_BATCH_SIZE 12)  # sources per unity-build batch

# Flags of this build. Users of installed targets do not get them.
add_compile_options(
  "$<$<COMPILE_LANGUAGE:CXX>:-Wall;-Wextra;-Wpedantic;-Wshadow;-Woverloaded-virtual>"
  # Designated initializers intentionally leave the other members at their defaults.
  $<$<COMPILE_LANGUAGE:CXX>:-Wno-missing-field-initializers>
  # Libraries and programs have the same setting, so that both can use one precompiled header.
  "$<IF:$<COMPILE_LANGUAGE:CUDA>,-Xcompiler=-fPIC,-fPIC>"
  # These warnings of g++ 13 are wrong. It assumes that every returned reference refers to a temporary argument, and
  # that inlined code of fmt 9 copies more digits than its big integers have.
  "$<$<AND:$<COMPILE_LANGUAGE:CXX>,$<BOOL:${PICTURA_HAS_WDANGLING_REFERENCE}>>:-Wno-dangling-reference;-Wno-array-bounds;-Wno-stringop-overflow>"
  # In a unity build sources are included. g++ warns about them as about headers that could be included several times.
  $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CXX_COMPILER_ID:GNU>,$<BOOL:$<TARGET_PROPERTY:UNITY_BUILD>>>:-Wno-subobject-linkage>
  $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<BOOL:${PICTURA_WERROR}>>:-Werror>
  # Rules of arithmetic on all devices: no fused multiply-add, and no reordering of operations.
  "$<$<COMPILE_LANGUAGE:CXX>:-ffp-contract=off;-fno-math-errno;-fno-trapping-math>"
  $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<BOOL:${PICTURA_CPU_ARCH}>>:-march=${PICTURA_CPU_ARCH}>)
set(PICTURA_IS_SANITIZED 0)  # for tests with time limits
if(PICTURA_SANITIZE)
  set(PICTURA_IS_SANITIZED 1)
  add_compile_options(-fsanitize=${PICTURA_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all
    # With sanitizers, g++ 13 warns wrongly, because it does not know the length of initializer lists.
    "$<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CXX_COMPILER_ID:GNU>>:-Wno-array-bounds;-Wno-stringop-overread>"
    $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CXX_COMPILER_ID:Clang>>:-fsanitize-ignorelist=${PROJECT_SOURCE_DIR}/cmake/sanitizer_ignorelist.txt>)
  add_link_options(-fsanitize=${PICTURA_SANITIZE})
endif()

# pictura_use_headers(TARGET SCOPE): sets the requirements of all users of the headers, in the tree and when installed.
function(pictura_use_headers target scope)
  target_compile_features(${target} ${scope} cxx_std_20)
  target_include_directories(${target} ${scope} $<BUILD_INTERFACE:${PICTURA_INCLUDE_DIR}>)
endfunction()

# pictura_add_library(NAME SOURCES... [PUBLIC libs...] [PRIVATE libs...]): adds the static library pictura_NAME with the
# alias pictura::NAME.
function(pictura_add_library name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;PUBLIC;PRIVATE")
  add_library(pictura_${name} STATIC ${arg_SOURCES})
  add_library(pictura::${name} ALIAS pictura_${name})
  set_target_properties(pictura_${name} PROPERTIES EXPORT_NAME ${name})
  pictura_use_headers(pictura_${name} PUBLIC)
  target_link_libraries(pictura_${name} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE})
endfunction()

# pictura_forbid_fma(TARGET): disables FMA instructions, for code whose results must equal a device's bit for bit. g++
# 12 ignores -ffp-contract when it vectorises alternating sums and differences (vfmaddsub).
function(pictura_forbid_fma target)
  if(PICTURA_HAS_MNO_FMA)
    target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-mno-fma>)
  endif()
endfunction()

# pictura_leave_unoptimized(TARGET): disables optimization, for code that only calls optimized code. Optimization takes
# three quarters of the time to compile a test.
function(pictura_leave_unoptimized target)
  target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-O0>)
endfunction()

# pictura_optimize_little(TARGET): reduces optimization, for code that reads options and prints results, because its
# templates compile slowly.
function(pictura_optimize_little target)
  target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-O1>)
endfunction()

# pictura_compile_together(TARGET): with PICTURA_UNITY, compiles several sources as one, for code whose templates take
# most of the time to compile each source. Libraries that other libraries use are compiled source by source, so that a
# missing include causes an error.
function(pictura_compile_together target)
  if(PICTURA_UNITY)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON)
  endif()
endfunction()

# pictura_precompile(NAME HEADERS [LINK libs...]): adds a precompiled header of headers of libraries, which take longer
# to compile than most sources that include them. pictura_use_precompiled(TARGET NAME) uses it. It does not contain
# headers of the project and of the standard library, except those that HEADERS include, so that a missing include
# causes an error. PICTURA_PRECOMPILE=OFF disables precompiled headers.
function(pictura_precompile name headers)
  if(PICTURA_PRECOMPILE)
    cmake_parse_arguments(PARSE_ARGV 2 arg "" "" "LINK")
    file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/precompiled/${name}.cpp CONTENT "// A precompiled header belongs to a source.\n")
    add_library(pictura_precompiled_${name} OBJECT ${PROJECT_BINARY_DIR}/precompiled/${name}.cpp)
    pictura_use_headers(pictura_precompiled_${name} PRIVATE)
    target_link_libraries(pictura_precompiled_${name} PRIVATE OpenMP::OpenMP_CXX ${arg_LINK})
    target_precompile_headers(pictura_precompiled_${name} PRIVATE ${headers})
  endif()
endfunction()

function(pictura_use_precompiled target name)
  if(PICTURA_PRECOMPILE)
    target_precompile_headers(${target} REUSE_FROM pictura_precompiled_${name})
  endif()
endfunction()

# pictura_test_properties(OUT SECONDS LABELS): sets OUT to ctest properties: a timeout, labels and the environment.
function(pictura_test_properties out timeout_s labels)
  set(properties TIMEOUT ${timeout_s})
  if(labels)
    string(REPLACE ";" "\\;" escaped_labels "${labels}")
    list(APPEND properties LABELS "${escaped_labels}")
  endif()
  set(environment ${PICTURA_TEST_ENVIRONMENT})
  if(gpu IN_LIST labels)
    # Tests share a cache of compiled kernels, because the kernels of a rig take seconds to compile.
    list(REMOVE_ITEM environment PICTURA_CACHE=off)
    list(APPEND environment XDG_CACHE_HOME=${PROJECT_BINARY_DIR}/cache)
  endif()
  if(environment)
    string(REPLACE ";" "\\;" environment "${environment}")
    list(APPEND properties ENVIRONMENT "${environment}")
  endif()
  set(${out} "${properties}" PARENT_SCOPE)
endfunction()

# pictura_add_test(NAME SOURCES... LINK libs... [LABELS labels...] [PRECOMPILED header] [WHOLE suites...] [OPTIMIZED]):
# adds the GoogleTest binary NAME_test, with a ctest entry for each test. PICTURA_DATA is set to ../shared/data if this
# folder exists and the caller has not set the variable. WHOLE: suites with one entry each, because their tests share
# expensive results, or take less time than a start of a program with torch (0.3 s). OPTIMIZED: compiles the test with
# optimization, for tests with much computation. The label threads marks tests of code that runs on several threads: the
# target threaded_tests builds only these tests, and the preset tsan runs only these.
add_custom_target(threaded_tests)
function(pictura_add_test name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "OPTIMIZED" "PRECOMPILED" "SOURCES;LINK;LABELS;WHOLE")
  find_package(GTest REQUIRED)
  include(GoogleTest)
  add_executable(${name}_test ${arg_SOURCES})
  pictura_use_headers(${name}_test PRIVATE)
  # All tests use OpenMP, because a precompiled header requires equal flags.
  target_link_libraries(${name}_test PRIVATE ${arg_LINK} OpenMP::OpenMP_CXX GTest::gmock GTest::gtest_main)
  pictura_compile_together(${name}_test)
  if(arg_PRECOMPILED)
    pictura_use_precompiled(${name}_test ${arg_PRECOMPILED})
  else()
    # Many tests compute with functions that the host and CUDA share.
    pictura_forbid_fma(${name}_test)
    if(NOT arg_OPTIMIZED)
      pictura_use_precompiled(${name}_test gtest)
    endif()
  endif()
  if(NOT arg_OPTIMIZED)
    pictura_leave_unoptimized(${name}_test)
  endif()
  if(PICTURA_SANITIZE AND arg_LINK MATCHES "pictura::(map|simulator|make_simulator)|pictura_scene_fixture")
    # With -O1 clang inlines few templates, and the linker takes the first of equal functions. Without this option, the
    # importer of maps would use the unoptimized functions of the test.
    target_link_options(${name}_test PRIVATE
      LINKER:--whole-archive $<TARGET_FILE:pictura_map> $<TARGET_FILE:pictura_common> LINKER:--no-whole-archive)
  endif()
  if(threads IN_LIST arg_LABELS)
    add_dependencies(threaded_tests ${name}_test)
  endif()
  pictura_test_properties(properties 900 "${arg_LABELS}")
  set(filter)
  foreach(suite ${arg_WHOLE})
    add_test(NAME ${suite} COMMAND ${name}_test --gtest_filter=${suite}.*)
    set_tests_properties(${suite} PROPERTIES ${properties} COST 400)
    list(APPEND filter ${suite}.*)
  endforeach()
  if(filter)
    list(JOIN filter ":" filter)
    set(filter TEST_FILTER "-${filter}")
  endif()
  gtest_discover_tests(${name}_test ${filter} DISCOVERY_TIMEOUT 120 PROPERTIES ${properties})
endfunction()

# Environment of tests. Maps are not cached, so that tests use the importer of this build. Torch's idle threads sleep,
# because spinning threads of parallel tests would compete for the processor.
set(PICTURA_TEST_ENVIRONMENT PICTURA_CACHE=off OMP_WAIT_POLICY=passive)
if(NOT DEFINED ENV{PICTURA_DATA} AND EXISTS ${PROJECT_SOURCE_DIR}/../shared/data)
  get_filename_component(data_folder ${PROJECT_SOURCE_DIR}/../shared/data REALPATH)
  list(APPEND PICTURA_TEST_ENVIRONMENT PICTURA_DATA=${data_folder})
endif()
if(PICTURA_SANITIZE MATCHES thread)
  list(APPEND PICTURA_TEST_ENVIRONMENT TSAN_OPTIONS=ignore_noninstrumented_modules=1:die_after_fork=0)
elseif(PICTURA_SANITIZE MATCHES address)
  # The sanitizer guesses where libraries that are loaded at run time have thread-local variables. For Mesa's libraries
  # it may guess wrong and abort.
  list(APPEND PICTURA_TEST_ENVIRONMENT ASAN_OPTIONS=intercept_tls_get_addr=0 UBSAN_OPTIONS=print_stacktrace=1
    LSAN_OPTIONS=suppressions=${PROJECT_SOURCE_DIR}/tests/support/leaks.txt:print_suppressions=0)
endif()
