// OpenGL contexts of OSMesa or EGL, without any OpenGL header. Their libraries are loaded when a context is created,
// never linked, so that the program starts without them.
#pragma once

#include <memory>
#include <string>

#include "pictura/common/support/shared_library.h"

namespace pictura::gl {

/// An OpenGL 4.5 core context, not current in any thread until a CurrentContext makes it so.
class Context {
 public:
  virtual ~Context() = default;
  Context() = default;
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  /// "gl:osmesa" or "gl:egl".
  virtual std::string name() const = 0;
  /// Address of an OpenGL function, or null.
  virtual void* entry_point(const char* name) const = 0;
  /// Makes it current in the calling thread, and saves which context of the same library was.
  virtual void enter() = 0;
  /// Restores the context saved by enter().
  virtual void leave() = 0;
};

/// Throws Error if libOSMesa or its context is missing.
std::unique_ptr<Context> make_osmesa_context();

/// On a GPU if EGL offers one, else Mesa's software rasterizer, without any window system. Of several GPUs the one with
/// CUDA's index cuda_device, unless that is -1. Throws Error if libEGL, such a device or its context is missing.
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
