// An array texture that stores all samples of images of one size, one image a layer. A pass averages the samples into
// planar images.
#pragma once

#include <initializer_list>
#include <memory>
#include <string>
#include <utility>

#include "pictura/backend_gl/cuda/interop.h"
#include "pictura/backend_gl/gl_functions.h"
#include "pictura/common/renderer.h"

namespace pictura::gl {

/// Throws Error with the compiler's log.
GLuint make_program(const Functions& gl, std::initializer_list<std::pair<GLenum, std::string>> shaders);

/// Throws Error if OpenGL has reported an error. where: beginning of the message.
void check_errors(const Functions& gl, const std::string& where);

/// Images of one size. The context must be current in all calls, including the destructor.
class ImageArray {
 public:
  /// Error messages begin with `renderer`. `interop` copies images to device memory; if it is null, images are copied
  /// to the host. Throws Error if the driver cannot store one image with these samples.
  ImageArray(const Functions& gl, std::string renderer, const PixelSamples& samples, const CudaInterop* interop,
             int width_px, int height_px);
  ~ImageArray() { release(); }
  ImageArray(const ImageArray&) = delete;
  ImageArray& operator=(const ImageArray&) = delete;

  /// Returns the number of allocated images, which the driver and a fixed maximum may limit.
  int reserve(int64_t images, PixelFormat format);
  /// Makes the layers the render target, and clears them.
  void begin();
  /// Averages the first `images` layers into the buffer.
  void resolve(int images);
  /// Appends to *copies_out the copies that write images [first, first + images) into `out`. stride: values from one
  /// image to the next.
  void plan_copy(int first, int images, void* out, int64_t stride, std::vector<RowCopy>* copies_out) const;
  /// Copies to the host are finished when the call returns; copies to a device are enqueued.
  void copy(Span<const RowCopy> copies, Stream stream);

 private:
  int max_layers() const;
  std::size_t plane_bytes() const;
  GLuint make_texture(GLenum format) const;
  void make_storage();
  void make_resolve_program();
  void release();

  const Functions& gl_;
  const std::string renderer_;
  const PixelSamples samples_;
  const CudaInterop* interop_;
  const int width_px_, height_px_;
  PixelFormat format_ = PixelFormat::u8;
  int layers_ = 0;
  GLuint color_ = 0, depth_ = 0, framebuffer_ = 0, output_ = 0, resolve_program_ = 0;
  std::unique_ptr<CudaBuffer> on_device_;
};

}  // namespace pictura::gl
