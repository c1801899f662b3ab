#include "pictura/common/support/shared_library.h"

#include <dlfcn.h>

#include "pictura/common/error.h"

namespace pictura {

SharedLibrary::SharedLibrary(const std::string& renderer, const std::string& file, const std::string& source)
    : renderer_(renderer), file_(file), handle_(dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE)) {
  PICTURA_CHECK(handle_, "renderer {}: cannot open {} ({}): {}", renderer, file, source, dlerror());
}

void* SharedLibrary::function(const char* name) const {
  void* const address = dlsym(handle_, name);
  PICTURA_CHECK(address, "renderer {}: {} has no function {}", renderer_, file_, name);
  return address;
}

}  // namespace pictura
