// OpenGL contexts of OSMesa or EGL. Their libraries are loaded when a context is made, so that the program also starts
// without them.
#pragma once

#include <memory>
#include <string>

#include "pictura/common/support/shared_library.h"

namespace pictura::gl {

/// An OpenGL 4.5 core context.
class Context {
 public:
  virtual ~Context() = default;
  Context() = default;
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  /// Returns "gl:osmesa" or "gl:egl".
  virtual std::string name() const = 0;
  /// Address of an OpenGL function, or null.
  virtual void* entry_point(const char* name) const = 0;
  /// Makes the context current, and saves the library's previous context.
  virtual void enter() = 0;
  /// Restores the context saved by enter().
  virtual void leave() = 0;
};

/// Throws Error if libOSMesa or its context is missing.
std::unique_ptr<Context> make_osmesa_context();

/// Makes a context on a GPU if EGL offers a GPU, else with Mesa's software rasterizer. cuda_device: CUDA index of the
/// GPU to use; -1: any. Throws Error if libEGL, the device or its context is missing.
std::unique_ptr<Context> make_egl_context(int cuda_device = -1);

class CurrentContext {
 public:
  explicit CurrentContext(Context* context) : context_(context) { context_->enter(); }
  ~CurrentContext() { context_->leave(); }
  CurrentContext(const CurrentContext&) = delete;
  CurrentContext& operator=(const CurrentContext&) = delete;

 private:
  Context* context_;
};

}  // namespace pictura::gl
