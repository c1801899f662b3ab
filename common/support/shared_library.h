// Libraries that are opened at run time, so that programs also start on machines without these libraries.
#pragma once

#include <string>

#include "pictura/common/error_types.h"

namespace pictura {

/// A library that stays open for the rest of the process, because drivers cannot be unloaded safely.
class SharedLibrary {
 public:
  /// Throws Error "renderer RENDERER: cannot open FILE (SOURCE): reason"; `source` tells users where to get the
  /// library.
  SharedLibrary(const std::string& renderer, const std::string& file, const std::string& source);
  /// Returns the address of a function. Throws Error naming the function.
  void* function(const char* name) const;

 private:
  std::string renderer_, file_;
  void* handle_ = nullptr;
};

}  // namespace pictura
