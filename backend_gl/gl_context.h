// OpenGL contexts of OSMesa or EGL, without any OpenGL header. Their libraries are loaded when a context is created and
// never linked, so that the program starts without them.
#pragma once

#include <memory>
#include <string>

#include "pictura/common/support/shared_library.h"

namespace pictura::gl {

/// An OpenGL 4.5 core context, which is current in a thread only through CurrentContext.
class Context {
 public:
  virtual ~Context() = default;
  Context() = default;
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  /// Name of the context: "gl:osmesa" or "gl:egl".
  virtual std::string name() const = 0;
  /// Address of an OpenGL function, or null.
  virtual void* entry_point(const char* name) const = 0;
  /// Makes the context current in the calling thread, and saves the previous context of the same library.
  virtual void enter() = 0;
  /// Restores the context saved by enter().
  virtual void leave() = 0;
};

/// Makes a context of OSMesa. Throws Error if libOSMesa or its context is missing.
std::unique_ptr<Context> make_osmesa_context();

/// Makes a context without any window system: on a GPU if EGL offers one, else with Mesa's software rasterizer. Among
/// several GPUs, it uses the one with CUDA's index cuda_device, unless that is -1. Throws Error if libEGL, the device
/// or its context is missing.
std::unique_ptr<Context> make_egl_context(int cuda_device = -1);

/// Makes a context current for its own lifetime.
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
