# Enables the CUDA language and toolkit if nvcc 12.8 or later is found. Architectures come from the preset.

set(PICTURA_HAS_CUDA OFF)
if(NOT PICTURA_WITH_CUDA STREQUAL OFF)
  if(NOT CMAKE_CUDA_COMPILER AND NOT DEFINED ENV{CUDACXX} AND EXISTS /usr/local/cuda/bin/nvcc)
    set(CMAKE_CUDA_COMPILER /usr/local/cuda/bin/nvcc)
  endif()
  if(NOT CMAKE_CUDA_ARCHITECTURES)
    set(CMAKE_CUDA_ARCHITECTURES 90)
  endif()
  include(CheckLanguage)
  check_language(CUDA)
  if(CMAKE_CUDA_COMPILER AND CMAKE_VERSION VERSION_GREATER_EQUAL 3.26)
    enable_language(CUDA)
    set(CMAKE_CUDA_STANDARD 20)
    set(CMAKE_CUDA_STANDARD_REQUIRED ON)
    find_package(CUDAToolkit 12.8 REQUIRED)
    set(PICTURA_HAS_CUDA ON)
    # Device code rounds like host code: without fused multiply-add.
    add_compile_options(
      "$<$<COMPILE_LANGUAGE:CUDA>:--fmad=false;-Xcompiler=-Wall,-Wextra,-ffp-contract=off>"
      "$<$<AND:$<COMPILE_LANGUAGE:CUDA>,$<BOOL:${PICTURA_WERROR}>>:-Werror=all-warnings;-Xcompiler=-Werror>")
  elseif(PICTURA_WITH_CUDA STREQUAL ON)
    message(FATAL_ERROR "PICTURA_WITH_CUDA=ON needs nvcc 12.8 and CMake 3.26 or later (have CMake ${CMAKE_VERSION}, "
                        "nvcc '${CMAKE_CUDA_COMPILER}'): install the CUDA toolkit, and use .venv/bin/cmake")
  endif()
endif()
