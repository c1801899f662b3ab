# Runs at every build in which a source changed: writes OUTPUT, a C++ file of the functions that HEADER declares in
# namespace NAMESPACE, one for each of TEXTS: the text of a file NAME.ENDING in SOURCE_DIR as NAME_ENDING(), in which each
# {{file FILE}} is replaced by the text of a file beside it.
cmake_minimum_required(VERSION 3.25)
set(functions "")
foreach(file ${TEXTS})
  file(READ ${SOURCE_DIR}/${file} text)
  string(REPLACE . _ function ${file})
  string(REGEX MATCHALL "{{file [^}]+}}" marks "${text}")
  foreach(mark ${marks})
    string(REGEX REPLACE "{{file (.+)}}" "\\1" name ${mark})
    file(READ ${SOURCE_DIR}/${name} part)
    string(REPLACE "${mark}" "${part}" text "${text}")
  endforeach()
  # Compilers accept texts of 64 KiB; adjacent texts are concatenated.
  string(LENGTH "${text}" length)
  set(literals "")
  set(at 0)
  while(at LESS length)
    string(SUBSTRING "${text}" ${at} 16000 piece)
    string(APPEND literals "\n    R\"__text__(${piece})__text__\"sv")
    math(EXPR at "${at} + 16000")
    if(at LESS length)
      string(APPEND literals ",")
    endif()
  endwhile()
  string(APPEND functions "
std::string_view ${function}() {
  static const std::string text = joined({${literals}});
  return text;
}
")
endforeach()
file(WRITE ${OUTPUT} "// Written by cmake/EmbedTexts.cmake.
#include \"${HEADER}\"

#include <initializer_list>
#include <string>

namespace ${NAMESPACE} {

namespace {
using namespace std::string_view_literals;
std::string joined(std::initializer_list<std::string_view> pieces) {
  std::string text;
  for (const std::string_view piece : pieces) text += piece;
  return text;
}
}  // namespace
${functions}
}  // namespace ${NAMESPACE}
")
