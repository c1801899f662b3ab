#include "pictura/backend_gl/image_array.h"

#include <algorithm>
#include <cstring>

#include "pictura/backend_gl/shaders.h"
#include "pictura/common/error.h"

namespace pictura::gl {

namespace {

// Maximum memory for the samples of one array, unless a single image needs more.
constexpr int64_t kArrayBytes = int64_t{256} << 20;

GLenum color_format(PixelFormat format) { return format == PixelFormat::u8 ? GL_RGBA8 : GL_RGBA32F; }

int64_t texel_bytes(PixelFormat format) { return 4 + (format == PixelFormat::u8 ? 4 : 16); }

template <typename Parameter, typename Log>
std::string log_of(GLuint object, Parameter&& parameter, Log&& log) {
  GLint length = 0;
  parameter(object, GL_INFO_LOG_LENGTH, &length);
  std::string text(static_cast<std::size_t>(std::max(length, 1)), '\0');
  log(object, length, nullptr, text.data());
  return text.c_str();
}

}  // namespace

GLuint make_program(const Functions& gl, std::initializer_list<std::pair<GLenum, std::string>> shaders) {
  const GLuint program = gl.CreateProgram();
  for (const auto& [stage, source] : shaders) {
    const GLuint shader = gl.CreateShader(stage);
    const char* const text = source.c_str();
    gl.ShaderSource(shader, 1, &text, nullptr);
    gl.CompileShader(shader);
    GLint compiled = 0;
    gl.GetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
    PICTURA_CHECK(compiled, "OpenGL: a shader does not compile: {}",
                  log_of(shader, gl.GetShaderiv, gl.GetShaderInfoLog));
    gl.AttachShader(program, shader);
    gl.DeleteShader(shader);
  }
  gl.LinkProgram(program);
  GLint linked = 0;
  gl.GetProgramiv(program, GL_LINK_STATUS, &linked);
  PICTURA_CHECK(linked, "OpenGL: a program does not link: {}", log_of(program, gl.GetProgramiv, gl.GetProgramInfoLog));
  return program;
}

void check_errors(const Functions& gl, const std::string& where) {
  const GLenum error = gl.GetError();
  PICTURA_CHECK(error == GL_NO_ERROR, "{}: OpenGL error {:#x}{}", where, error,
                error == GL_OUT_OF_MEMORY ? " (out of memory)" : "");
}

ImageArray::ImageArray(const Functions& gl, std::string renderer, const PixelSamples& samples,
                       const CudaInterop* interop, int width_px, int height_px)
    : gl_(gl),
      renderer_(std::move(renderer)),
      samples_(samples),
      interop_(interop),
      width_px_(width_px),
      height_px_(height_px) {
  const int max_texels = gl_.integer(GL_MAX_TEXTURE_SIZE);
  const int64_t texels = int64_t{samples_.grid} * std::max(width_px_, height_px_);
  PICTURA_CHECK(texels <= max_texels,
                "renderer {}: {}x{} pixels of {}x{} samples: expected at most {} samples along an axis, which is this "
                "driver's limit, got {}",
                renderer_, width_px_, height_px_, samples_.grid, samples_.grid, max_texels, texels);
  const int max_samples =
      std::min(gl_.integer(GL_MAX_COLOR_TEXTURE_SAMPLES), gl_.integer(GL_MAX_DEPTH_TEXTURE_SAMPLES));
  PICTURA_CHECK(samples_.multisample <= max_samples,
                "renderer {}: expected at most {} samples, which is this driver's limit for MSAA, got {}", renderer_,
                max_samples, samples_.multisample);
}

std::size_t ImageArray::plane_bytes() const {
  const std::size_t pixels = static_cast<std::size_t>(width_px_) * static_cast<std::size_t>(height_px_);
  return format_ == PixelFormat::u8 ? (pixels + 3) / 4 * 4 : 4 * pixels;
}

int ImageArray::max_layers() const {
  const int64_t image_bytes = 3 * static_cast<int64_t>(plane_bytes());
  const int64_t max_bytes = gl_.integer(GL_MAX_SHADER_STORAGE_BLOCK_SIZE);
  PICTURA_CHECK(image_bytes <= max_bytes,
                "renderer {}: {}x{} pixels: expected at most {} bytes per image, which is this driver's limit, got {}",
                renderer_, width_px_, height_px_, max_bytes, image_bytes);
  const int64_t texels = int64_t{width_px_} * height_px_ * samples_.grid * samples_.grid * samples_.multisample;
  const int64_t most = std::max<int64_t>(1, kArrayBytes / (texels * texel_bytes(format_)));
  return static_cast<int>(std::min({most, max_bytes / image_bytes, int64_t{gl_.integer(GL_MAX_ARRAY_TEXTURE_LAYERS)},
                                    int64_t{gl_.integer(GL_MAX_FRAMEBUFFER_LAYERS)}}));
}

GLuint ImageArray::make_texture(GLenum format) const {
  const int width = samples_.grid * width_px_, height = samples_.grid * height_px_;
  GLuint texture = 0;
  if (samples_.multisample > 1) {
    gl_.CreateTextures(GL_TEXTURE_2D_MULTISAMPLE_ARRAY, 1, &texture);
    gl_.TextureStorage3DMultisample(texture, samples_.multisample, format, width, height, layers_, GL_TRUE);
  } else {
    gl_.CreateTextures(GL_TEXTURE_2D_ARRAY, 1, &texture);
    gl_.TextureStorage3D(texture, 1, format, width, height, layers_);
  }
  return texture;
}

void ImageArray::release() {
  on_device_.reset();
  gl_.DeleteProgram(resolve_program_);
  gl_.DeleteBuffers(1, &output_);
  gl_.DeleteFramebuffers(1, &framebuffer_);
  gl_.DeleteTextures(1, &color_);
  gl_.DeleteTextures(1, &depth_);
  resolve_program_ = output_ = framebuffer_ = color_ = depth_ = 0;
  layers_ = 0;
}

int ImageArray::reserve(int64_t images, PixelFormat format) {
  if (format_ != format) release();
  format_ = format;
  const int wanted = static_cast<int>(std::min<int64_t>(images, max_layers()));
  if (wanted <= layers_) return layers_;
  release();
  layers_ = wanted;
  try {
    make_storage();
    make_resolve_program();
  } catch (...) {
    release();
    throw;
  }
  return layers_;
}

void ImageArray::make_storage() {
  color_ = make_texture(color_format(format_));
  depth_ = make_texture(GL_DEPTH_COMPONENT32F);
  gl_.CreateFramebuffers(1, &framebuffer_);
  gl_.NamedFramebufferTexture(framebuffer_, GL_COLOR_ATTACHMENT0, color_, 0);
  gl_.NamedFramebufferTexture(framebuffer_, GL_DEPTH_ATTACHMENT, depth_, 0);
  gl_.CreateBuffers(1, &output_);
  gl_.NamedBufferStorage(output_, static_cast<GLsizeiptr>(3 * plane_bytes() * static_cast<std::size_t>(layers_)),
                         nullptr, interop_ ? 0 : GL_MAP_READ_BIT);
  const std::string where =
      fmt::format("renderer {}: allocating {} images of {}x{} pixels", renderer_, layers_, width_px_, height_px_);
  check_errors(gl_, where);
  const GLenum status = gl_.CheckNamedFramebufferStatus(framebuffer_, GL_FRAMEBUFFER);
  PICTURA_CHECK(status == GL_FRAMEBUFFER_COMPLETE, "{}: OpenGL framebuffer status {:#x}", where, status);
  if (interop_) on_device_ = interop_->share(output_);
}

void ImageArray::make_resolve_program() {
  // Reads the number of samples, because the driver may use more samples than requested.
  GLint samples = 1;
  if (samples_.multisample > 1) gl_.GetTextureLevelParameteriv(color_, 0, GL_TEXTURE_SAMPLES, &samples);
  resolve_program_ = make_program(
      gl_, {{GL_COMPUTE_SHADER,
             fmt::format("#version 450 core\n#define MULTISAMPLE {}\n#define PACKED {}\n{}",
                         samples_.multisample > 1 ? 1 : 0, format_ == PixelFormat::u8 ? 1 : 0, kResolveShader)}});
  auto set = [&](const char* name, GLint value) {
    gl_.ProgramUniform1i(resolve_program_, gl_.GetUniformLocation(resolve_program_, name), value);
  };
  gl_.ProgramUniform2i(resolve_program_, gl_.GetUniformLocation(resolve_program_, "size"), width_px_, height_px_);
  set("grid", samples_.grid);
  set("samples", samples);
  set("plane_words", static_cast<GLint>(plane_bytes() / 4));
}

void ImageArray::begin() {
  constexpr GLfloat kBlack[4] = {0, 0, 0, 1}, kInfinitelyFar = 0;
  gl_.ClearNamedFramebufferfv(framebuffer_, GL_COLOR, 0, kBlack);
  gl_.ClearNamedFramebufferfv(framebuffer_, GL_DEPTH, 0, &kInfinitelyFar);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  gl_.Viewport(0, 0, samples_.grid * width_px_, samples_.grid * height_px_);
}

void ImageArray::resolve(int images) {
  constexpr std::size_t kGroup = 64;         // local_size_x
  constexpr std::size_t kMaxGroups = 65535;  // OpenGL's guaranteed minimum along an axis
  gl_.BindTextureUnit(0, color_);
  gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, output_);
  gl_.UseProgram(resolve_program_);
  const std::size_t groups = std::min((plane_bytes() / 4 + kGroup - 1) / kGroup, kMaxGroups);
  gl_.DispatchCompute(static_cast<GLuint>(groups), static_cast<GLuint>(images), 1);
  gl_.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
}

void ImageArray::plan_copy(int first, int images, void* out, int64_t stride, std::vector<RowCopy>* copies_out) const {
  const std::size_t value_bytes = bytes_per_value(format_);
  const std::size_t row_bytes =
      static_cast<std::size_t>(width_px_) * static_cast<std::size_t>(height_px_) * value_bytes;
  // A single image may have any stride, but CUDA rejects a pitch below the size of a row.
  const std::size_t pitch = images > 1 ? static_cast<std::size_t>(stride) * value_bytes : row_bytes;
  for (std::size_t plane = 0; plane < 3; ++plane) {
    copies_out->push_back({(3 * static_cast<std::size_t>(first) + plane) * plane_bytes(), 3 * plane_bytes(),
                           static_cast<std::byte*>(out) + plane * row_bytes, pitch, row_bytes,
                           static_cast<std::size_t>(images)});
  }
}

void ImageArray::copy(Span<const RowCopy> copies, Stream stream) {
  if (on_device_) return on_device_->copy(copies, stream);
  const auto bytes = static_cast<GLsizeiptr>(3 * plane_bytes() * static_cast<std::size_t>(layers_));
  const auto* mapped = static_cast<const std::byte*>(gl_.MapNamedBufferRange(output_, 0, bytes, GL_MAP_READ_BIT));
  check_errors(gl_, fmt::format("renderer {}: reading images back", renderer_));
  for (const RowCopy& rows : copies) {
    for (std::size_t row = 0; row < rows.rows; ++row) {
      std::memcpy(rows.to + row * rows.to_pitch, mapped + rows.from + row * rows.from_pitch, rows.row_bytes);
    }
  }
  gl_.UnmapNamedBuffer(output_);
}

}  // namespace pictura::gl
