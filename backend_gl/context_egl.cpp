// OpenGL through EGL without a window system: on a GPU with the driver of NVIDIA or another vendor, else on Mesa's
// surfaceless platform.
#include <string_view>
#include <vector>

#define EGL_NO_X11
#define EGL_NO_PLATFORM_SPECIFIC_TYPES
#include <EGL/egl.h>
#include <EGL/eglext.h>

#include "pictura/backend_gl/gl_context.h"
#include "pictura/common/error.h"

namespace pictura::gl {

namespace {

constexpr const char* kName = "gl:egl";

/// Entry points of libEGL.
class Egl {
  SharedLibrary library_{kName, "libEGL.so.1", "Debian package libegl1"};
  template <typename Function>
  Function function(const char* name) const {
    return reinterpret_cast<Function>(library_.function(name));
  }
  template <typename Function>
  Function extension(const char* name) const {
    return reinterpret_cast<Function>(get_proc_address(name));
  }

 public:
  decltype(&eglBindAPI) bind_api = function<decltype(bind_api)>("eglBindAPI");
  decltype(&eglCreateContext) create_context = function<decltype(create_context)>("eglCreateContext");
  decltype(&eglDestroyContext) destroy_context = function<decltype(destroy_context)>("eglDestroyContext");
  decltype(&eglGetCurrentContext) get_current_context = function<decltype(get_current_context)>("eglGetCurrentContext");
  decltype(&eglGetCurrentDisplay) get_current_display = function<decltype(get_current_display)>("eglGetCurrentDisplay");
  decltype(&eglGetCurrentSurface) get_current_surface = function<decltype(get_current_surface)>("eglGetCurrentSurface");
  decltype(&eglGetError) get_error = function<decltype(get_error)>("eglGetError");
  decltype(&eglGetPlatformDisplay) get_platform_display =
      function<decltype(get_platform_display)>("eglGetPlatformDisplay");
  decltype(&eglGetProcAddress) get_proc_address = function<decltype(get_proc_address)>("eglGetProcAddress");
  decltype(&eglInitialize) initialize = function<decltype(initialize)>("eglInitialize");
  decltype(&eglMakeCurrent) make_current = function<decltype(make_current)>("eglMakeCurrent");
  decltype(&eglQueryAPI) query_api = function<decltype(query_api)>("eglQueryAPI");
  decltype(&eglQueryString) query_string = function<decltype(query_string)>("eglQueryString");
  // Functions of extensions; null if the extension is missing.
  PFNEGLQUERYDEVICESEXTPROC query_devices = extension<decltype(query_devices)>("eglQueryDevicesEXT");
  PFNEGLQUERYDEVICESTRINGEXTPROC query_device_string =
      extension<decltype(query_device_string)>("eglQueryDeviceStringEXT");
  PFNEGLQUERYDEVICEATTRIBEXTPROC query_device_attribute =
      extension<decltype(query_device_attribute)>("eglQueryDeviceAttribEXT");
};

bool has(const char* extensions, std::string_view name) {
  return extensions && std::string_view(extensions).find(name) != std::string_view::npos;
}

std::vector<EGLDeviceEXT> devices_of(const Egl& egl) {
  EGLint count = 0;
  if (!egl.query_devices || !egl.query_device_string || !egl.query_devices(0, nullptr, &count)) return {};
  std::vector<EGLDeviceEXT> devices(static_cast<std::size_t>(count));
  if (!egl.query_devices(count, devices.data(), &count)) return {};
  devices.resize(count);
  return devices;
}

bool is_cuda_device(const Egl& egl, EGLDeviceEXT device, int cuda_device) {
  EGLAttrib number = -1;
  return has(egl.query_device_string(device, EGL_EXTENSIONS), "EGL_NV_device_cuda") && egl.query_device_attribute &&
         egl.query_device_attribute(device, EGL_CUDA_DEVICE_NV, &number) && number == cuda_device;
}

bool is_gpu(const Egl& egl, EGLDeviceEXT device) {
  return !has(egl.query_device_string(device, EGL_EXTENSIONS), "EGL_MESA_device_software");
}

// Opens the display. It is never terminated, because the whole process shares it.
EGLDisplay open_display(const Egl& egl, int cuda_device) {
  auto initialized = [&](EGLenum platform, void* native) {
    const EGLDisplay display = egl.get_platform_display(platform, native, nullptr);
    return display != EGL_NO_DISPLAY && egl.initialize(display, nullptr, nullptr) ? display : EGL_NO_DISPLAY;
  };
  for (const EGLDeviceEXT device : devices_of(egl)) {
    if (cuda_device < 0 ? !is_gpu(egl, device) : !is_cuda_device(egl, device, cuda_device)) continue;
    const EGLDisplay display = initialized(EGL_PLATFORM_DEVICE_EXT, device);
    if (display != EGL_NO_DISPLAY) return display;
  }
  PICTURA_CHECK(cuda_device < 0,
                "renderer {}: EGL has no device with CUDA's number {}; is NVIDIA's libEGL_nvidia.so.0 installed, and "
                "listed by a file in __EGL_VENDOR_LIBRARY_FILENAMES or /usr/share/glvnd/egl_vendor.d?",
                kName, cuda_device);
  const EGLDisplay display = initialized(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY);
  PICTURA_CHECK(display != EGL_NO_DISPLAY,
                "renderer {}: no GPU, and no software rasterizer either (Debian package libegl-mesa0): EGL error {:#x}",
                kName, egl.get_error());
  return display;
}

class EglContext final : public Context {
 public:
  explicit EglContext(int cuda_device) : display_(open_display(egl_, cuda_device)) {
    const EGLenum api_before = egl_.query_api();
    PICTURA_CHECK(egl_.bind_api(EGL_OPENGL_API), "renderer {}: the driver has only OpenGL ES", kName);
    const EGLint attributes[] = {
        EGL_CONTEXT_MAJOR_VERSION,           4,       EGL_CONTEXT_MINOR_VERSION, 5, EGL_CONTEXT_OPENGL_PROFILE_MASK,
        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
    context_ = egl_.create_context(display_, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    const EGLint error = egl_.get_error();
    egl_.bind_api(api_before);
    PICTURA_CHECK(context_ != EGL_NO_CONTEXT, "renderer {}: {} provides no OpenGL 4.5 core context: EGL error {:#x}",
                  kName, egl_.query_string(display_, EGL_VENDOR), error);
  }
  ~EglContext() override { egl_.destroy_context(display_, context_); }
  std::string name() const override { return kName; }
  void* entry_point(const char* name) const override { return reinterpret_cast<void*>(egl_.get_proc_address(name)); }

  void enter() override {
    // EGL returns the current context of the bound API. The bound API belongs to the thread.
    before_ = {egl_.query_api(), egl_.get_current_display(), egl_.get_current_context(),
               egl_.get_current_surface(EGL_DRAW), egl_.get_current_surface(EGL_READ)};
    if (egl_.bind_api(EGL_OPENGL_API) && egl_.make_current(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_)) return;
    const EGLint error = egl_.get_error();
    egl_.bind_api(before_.api);
    fail("renderer {}: cannot make its context current: EGL error {:#x}", kName, error);
  }
  void leave() override {
    egl_.make_current(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    egl_.bind_api(before_.api);
    if (before_.context != EGL_NO_CONTEXT) {
      egl_.make_current(before_.display, before_.draw, before_.read, before_.context);
    }
  }

 private:
  Egl egl_;
  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
  struct Before {
    EGLenum api = EGL_OPENGL_ES_API;
    EGLDisplay display = EGL_NO_DISPLAY;
    EGLContext context = EGL_NO_CONTEXT;
    EGLSurface draw = EGL_NO_SURFACE, read = EGL_NO_SURFACE;
  } before_;
};

}  // namespace

std::unique_ptr<Context> make_egl_context(int cuda_device) { return std::make_unique<EglContext>(cuda_device); }

}  // namespace pictura::gl
