# Script that runs at every build in which one of SOURCES changed. Writes OUTPUT with a hash of the contents of SOURCES
# and of COMPILER.
set(hashes "${COMPILER}")
foreach(source ${SOURCES})
  file(SHA256 ${source} hash)
  string(APPEND hashes " ${hash}")
endforeach()
string(SHA256 hash "${hashes}")
string(SUBSTRING ${hash} 0 16 hash)
file(WRITE ${OUTPUT} "// A hash of the sources that import maps.\n#pragma once\n\n#define PICTURA_MAP_FINGERPRINT 0x${hash}ull\n")
