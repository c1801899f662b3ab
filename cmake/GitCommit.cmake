# Script that runs at every build. Writes OUTPUT with the commit of the sources, but only if the commit has changed. The
# commit is COMMIT, or git's answer if COMMIT is empty.
set(commit "${COMMIT}")
if(commit STREQUAL "")
  execute_process(COMMAND git -C ${SOURCE} describe --always --dirty --abbrev=12
    OUTPUT_VARIABLE commit ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE RESULT_VARIABLE failed)
  if(NOT failed EQUAL 0)
    set(commit unknown)
  endif()
endif()
set(text "// The commit that this build was made from.\n#pragma once\n\n#define PICTURA_COMMIT \"${commit}\"\n")
if(EXISTS ${OUTPUT})
  file(READ ${OUTPUT} old)
endif()
if(NOT "${old}" STREQUAL "${text}")
  file(WRITE ${OUTPUT} "${text}")
endif()
