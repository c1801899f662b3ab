// Where OpenGL comes from: a context of OSMesa or of EGL, without any OpenGL header. Their libraries are opened when a
// context is asked for, never linked, so that the program starts where they are missing.
#pragma once

#include <memory>
#include <string>

#include "pictura/common/support/shared_library.h"

namespace pictura::gl {

/// An OpenGL 4.5 core context, current nowhere until a CurrentContext makes it so.
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
  /// Makes it the calling thread's, and remembers which context of the same library was.
  virtual void enter() = 0;
  /// Puts back what enter() found.
  virtual void leave() = 0;
};

/// Throws Error where libOSMesa or its context is missing.
std::unique_ptr<Context> make_osmesa_context();

/// On a GPU where EGL offers one, else Mesa's software rasterizer, without any window system. Of several GPUs the one
/// that CUDA numbers cuda_device, unless that is -1. Throws Error where libEGL, such a device or its context is
/// missing.
std::unique_ptr<Context> make_egl_context(int cuda_device = -1);

/// Makes a context current for as long as it lives.
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
