# Script that runs at every build in which a source changed. Writes OUTPUT, a C++ file with the texts of ROOTS and of
# all pictura headers that they include, as declared in backend_cuda/renderer/kernel_sources.h. Paths are relative to
# SOURCE_DIR. Fails if a header is missing in DEPENDENCIES (absolute paths), because its changes would not be embedded.
cmake_minimum_required(VERSION 3.25)
set(files ${ROOTS})
set(entries "")
set(program "")
foreach(root ${ROOTS})
  string(APPEND program "#include \\\"pictura/${root}\\\"\\n")
endforeach()
while(files)
  list(POP_FRONT files file)
  if(file IN_LIST seen)
    continue()
  endif()
  list(APPEND seen ${file})
  if(NOT ${SOURCE_DIR}/${file} IN_LIST DEPENDENCIES)
    message(FATAL_ERROR "${file}: included by the embedded kernels, but missing from their list of sources")
  endif()
  file(READ ${SOURCE_DIR}/${file} text)
  string(REGEX MATCHALL "#include \"pictura/[^\"]+\"" includes "${text}")
  foreach(include ${includes})
    string(REGEX REPLACE "#include \"pictura/(.+)\"" "\\1" header ${include})
    list(APPEND files ${header})
  endforeach()
  string(APPEND entries "    {\"pictura/${file}\", R\"__source__(${text})__source__\"},\n")
endwhile()
file(WRITE ${OUTPUT} "// Written by cmake/EmbedSources.cmake.
#include \"pictura/backend_cuda/renderer/kernel_sources.h\"

namespace pictura::cuda {

namespace {
constexpr KernelSource kHeaders[] = {
${entries}};
}  // namespace

KernelProgram renderer_program() { return {\"${program}\", {kHeaders, sizeof kHeaders / sizeof *kHeaders}}; }

}  // namespace pictura::cuda
")
