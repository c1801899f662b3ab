# Script that runs at every build in which a source changed. Writes OUTPUT, a C++ file with functions that HEADER
# declares in namespace NAMESPACE. For each file NAME.ENDING of TEXTS in SOURCE_DIR, the function NAME_ENDING() returns
# the text of the file. In the text, each {{file FILE}} is replaced by the text of that file in the same folder.
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
  # Compilers accept string literals of 64 KiB, and concatenate adjacent literals.
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
