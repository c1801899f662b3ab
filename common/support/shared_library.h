// Libraries that are opened at run time, so that programs also start without them.
#pragma once

#include <string>

#include "pictura/common/error_types.h"

namespace pictura {

/// A library that stays open, because drivers cannot be unloaded safely.
class SharedLibrary {
 public:
  /// Throws Error "renderer RENDERER: cannot open FILE (SOURCE): reason". SOURCE describes where users get the library.
  SharedLibrary(const std::string& renderer, const std::string& file, const std::string& source);
  /// Throws Error naming the function.
  void* function(const char* name) const;

 private:
  std::string renderer_, file_;
  void* handle_ = nullptr;
};

}  // namespace pictura
