// OpenGL through Mesa's off-screen interface: a software rasterizer in the calling process, which needs no display or
// device.
#include <GL/osmesa.h>

#include "pictura/backend_gl/gl_context.h"
#include "pictura/common/error.h"

namespace pictura::gl {

namespace {

class OsmesaContext final : public Context {
 public:
  OsmesaContext() {
    const int attributes[] = {OSMESA_FORMAT,
                              OSMESA_RGBA,
                              OSMESA_PROFILE,
                              OSMESA_CORE_PROFILE,
                              OSMESA_CONTEXT_MAJOR_VERSION,
                              4,
                              OSMESA_CONTEXT_MINOR_VERSION,
                              5,
                              0};
    context_ = create_(attributes, nullptr);
    PICTURA_CHECK(context_, "renderer {}: {} provides no OpenGL 4.5 core context", kName, kFile);
  }
  ~OsmesaContext() override { destroy_(context_); }
  std::string name() const override { return kName; }
  void* entry_point(const char* name) const override { return reinterpret_cast<void*>(get_proc_address_(name)); }

  void enter() override {
    before_ = {get_current_()};
    if (before_.context) {
      get_integer_(OSMESA_TYPE, &before_.type);
      GLint format = 0;
      get_color_buffer_(before_.context, &before_.width, &before_.height, &format, &before_.pixels);
    }
    PICTURA_CHECK(make_current_(context_, pixel_, GL_UNSIGNED_BYTE, 1, 1),
                  "renderer {}: cannot make its context current", kName);
  }
  void leave() override {
    make_current_(before_.context, before_.pixels, static_cast<GLenum>(before_.type), before_.width, before_.height);
  }

 private:
  static constexpr const char* kName = "gl:osmesa";
  static constexpr const char* kFile = "libOSMesa.so.8";

  template <typename Function>
  Function function(const char* name) const {
    return reinterpret_cast<Function>(library_.function(name));
  }

  SharedLibrary library_{kName, kFile, "Debian package libosmesa6"};
  decltype(&OSMesaCreateContextAttribs) create_ = function<decltype(create_)>("OSMesaCreateContextAttribs");
  decltype(&OSMesaDestroyContext) destroy_ = function<decltype(destroy_)>("OSMesaDestroyContext");
  decltype(&OSMesaMakeCurrent) make_current_ = function<decltype(make_current_)>("OSMesaMakeCurrent");
  decltype(&OSMesaGetCurrentContext) get_current_ = function<decltype(get_current_)>("OSMesaGetCurrentContext");
  decltype(&OSMesaGetIntegerv) get_integer_ = function<decltype(get_integer_)>("OSMesaGetIntegerv");
  decltype(&OSMesaGetColorBuffer) get_color_buffer_ = function<decltype(get_color_buffer_)>("OSMesaGetColorBuffer");
  decltype(&OSMesaGetProcAddress) get_proc_address_ = function<decltype(get_proc_address_)>("OSMesaGetProcAddress");

  OSMesaContext context_ = nullptr;
  unsigned char pixel_[4] = {};  // OSMesa requires a framebuffer; all drawing goes to textures
  struct Before {
    OSMesaContext context = nullptr;
    void* pixels = nullptr;
    GLint type = GL_UNSIGNED_BYTE, width = 0, height = 0;
  } before_;
};

}  // namespace

std::unique_ptr<Context> make_osmesa_context() { return std::make_unique<OsmesaContext>(); }

}  // namespace pictura::gl
