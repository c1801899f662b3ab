// Libraries that are opened at run time, so that a program starts where they are missing.
#pragma once

#include <string>

#include "pictura/common/error_types.h"

namespace pictura {

/// A library opened for the rest of the process: drivers do not survive being unloaded.
class SharedLibrary {
 public:
  /// Throws Error "renderer RENDERER: cannot open FILE (SOURCE): reason"; `source` says where one gets it.
  SharedLibrary(const std::string& renderer, const std::string& file, const std::string& source);
  /// Address of a function. Throws Error naming it.
  void* function(const char* name) const;

 private:
  std::string renderer_, file_;
  void* handle_ = nullptr;
};

}  // namespace pictura
