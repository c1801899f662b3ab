// OpenGL contexts of OSMesa or EGL; this header includes no OpenGL header. The libraries are loaded when a context is
// created and are never linked, so that the program also starts on machines without them.
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

  /// Name of the renderer on this context: "gl:osmesa" or "gl:egl".
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

/// Makes a context without a window system: on a GPU if EGL offers a GPU, else with Mesa's software rasterizer. If
/// cuda_device is not -1, it uses the GPU with this CUDA device index. Throws Error if libEGL, the device or its
/// context is missing.
std::unique_ptr<Context> make_egl_context(int cuda_device = -1);

/// Makes a context current during the lifetime of this object.
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
