# Defines the imported target `pictura_torch`: libtorch from the torch wheel of a Python. The Python is
# Python_EXECUTABLE, which scikit-build-core sets, or that of the virtual environment, or python3.
# The wheel's own CMake package is not used: it requires nvcc for CPU targets and links CUDA into everything.

set(PICTURA_HAS_TORCH OFF)
set(PICTURA_HAS_GLOO OFF)
if(NOT PICTURA_WITH_TORCH STREQUAL OFF)
  foreach(python ${Python_EXECUTABLE} ${PICTURA_VENV_PYTHONS} python3)
    execute_process(COMMAND ${python} -c
      "import importlib.util as u, importlib.metadata as m; print(u.find_spec('torch').submodule_search_locations[0], m.version('torch'))"
      OUTPUT_VARIABLE pictura_torch_found ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE RESULT_VARIABLE failed)
    if(failed EQUAL 0 AND pictura_torch_found MATCHES "^(.+) ([0-9]+\\.[0-9]+)[^ ]*$")
      set(torch_root ${CMAKE_MATCH_1})
      if(CMAKE_MATCH_2 VERSION_GREATER_EQUAL 2.9)
        set(PICTURA_HAS_TORCH ON)
        set(PICTURA_TORCH_PYTHON ${python})
        break()
      endif()
    endif()
  endforeach()
  if(PICTURA_HAS_TORCH)
    file(STRINGS ${torch_root}/version.py PICTURA_TORCH_VERSION REGEX "^__version__ = ")
    string(REGEX REPLACE "^__version__ = '(.*)'$" "\\1" PICTURA_TORCH_VERSION "${PICTURA_TORCH_VERSION}")
    add_library(pictura_torch INTERFACE)
    target_include_directories(pictura_torch SYSTEM INTERFACE
      ${torch_root}/include ${torch_root}/include/torch/csrc/api/include)
    # Libraries are linked by name, not by path: the wheel's folder also contains a libgomp, which the program then loads.
    target_link_libraries(pictura_torch INTERFACE -L${torch_root}/lib -ltorch_cpu -lc10)
    # A wheel must not contain paths of the build machine. It finds torch in its environment (bindings/CMakeLists.txt).
    if(NOT SKBUILD)
      target_link_libraries(pictura_torch INTERFACE -Wl,-rpath,${torch_root}/lib)
    endif()
    # Torch contains the library Gloo, with which processes communicate on the host, but not its headers (libgloo-dev).
    find_path(PICTURA_GLOO_INCLUDE gloo/context.h)
    if(PICTURA_GLOO_INCLUDE)
      set(PICTURA_HAS_GLOO ON)
    endif()
    message(STATUS "torch: ${torch_root} ${PICTURA_TORCH_VERSION}, Gloo ${PICTURA_HAS_GLOO}")
  elseif(PICTURA_WITH_TORCH STREQUAL ON)
    message(FATAL_ERROR "PICTURA_WITH_TORCH=ON, but no torch 2.9 or later: run scripts/setup, or set PICTURA_VENV")
  endif()
endif()
