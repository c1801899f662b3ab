// Renderer on the OpenGL graphics pipeline, a baseline for the CUDA renderer. The host builds faces by the rules of all
// renderers. OpenGL draws them as instances into array textures, one layer per image: it projects, clips, and decides
// visibility by depth.
#include <algorithm>
#include <cstring>

#include "pictura/backend_gl/image_array.h"
#include "pictura/backend_gl/image_faces.h"
#include "pictura/backend_gl/shaders.h"
#include "pictura/common/error.h"
#include "pictura/common/raster/check.h"
#include "pictura/common/raster/host_geometries.h"
#include "pictura/common/raster/randomize_camera.h"
#include "pictura/common/support/parallel_for.h"

namespace pictura {

std::unique_ptr<Renderer> make_gl_renderer(const std::string& name, const RendererConfig& config,
                                           std::string* choice_out);

namespace {

using gl::FaceInstance;

constexpr const char* kLayerExtension = "GL_ARB_shader_viewport_layer_array";

bool has_extension(const gl::Functions& functions, const char* wanted) {
  const int count = functions.integer(GL_NUM_EXTENSIONS);
  for (int i = 0; i < count; ++i) {
    const auto* name = functions.GetStringi(GL_EXTENSIONS, static_cast<GLuint>(i));
    if (name && std::strcmp(reinterpret_cast<const char*>(name), wanted) == 0) return true;
  }
  return false;
}

// Cameras of one size, whose images share an array.
struct SizeGroup {
  std::vector<std::size_t> cameras;  // indices in the rig
  std::unique_ptr<gl::ImageArray> array;
};

class GlRenderer final : public Renderer {
 public:
  GlRenderer(const RendererConfig& config, std::unique_ptr<gl::Context> context,
             std::unique_ptr<gl::CudaInterop> interop)
      : config_(config),
        cameras_(pinhole_cameras(config.rig)),
        context_(std::move(context)),
        interop_(std::move(interop)),
        memory_(interop_ ? interop_->device() : Device{}),
        name_(context_->name()) {
    PICTURA_CHECK(config_.samples.grid >= 1 && config_.samples.multisample >= 1,
                  "renderer {}: expected 1 sample or more, got a grid of {} and {} samples", name_,
                  config_.samples.grid, config_.samples.multisample);
    PICTURA_CHECK(!config_.randomization.changes_colors(),
                  "renderer {}: only cpu and cuda support randomized brightness, noise and lost images", name_);
    const gl::CurrentContext current(context_.get());
    gl_ = std::make_unique<gl::Functions>(*context_);
    drawn_by_ = reinterpret_cast<const char*>(gl_->GetString(GL_RENDERER));
    PICTURA_CHECK(has_extension(*gl_, kLayerExtension), "renderer {}: {} lacks {}", name_, drawn_by_, kLayerExtension);
    make_pipeline();
    groups_ = make_groups();  // last: if it throws, its objects are destroyed while the context is still current
  }
  ~GlRenderer() override {
    const gl::CurrentContext current(context_.get());
    groups_.clear();  // everything else is destroyed with the context
  }
  std::string_view name() const override { return name_; }
  Device device() const override { return memory_; }
  const RendererConfig& config() const override { return config_; }
  bool draws_all_formats() const override { return false; }
  /// Returns the driver's name of the device.
  const std::string& drawn_by() const { return drawn_by_; }

  void upload(GeometryHandle handle, const StaticGeometry& geometry, Stream) override {
    check_handle(name_, handle);
    check_geometry(name_, geometry);
    geometries_.upload(handle, geometry);
  }
  void release(GeometryHandle handle, Stream) override {
    check_handle(name_, handle);
    geometries_.release(handle);
  }

  void render(const SceneBatch& scene, const ViewBatch& views, const ImageBatch& images_out, Stream stream) override {
    check_images(*this, views.size(), images_out);
    for (std::size_t i = 0; i < images_out.cameras.size(); ++i) {
      const CameraImages& camera = images_out.cameras[i];
      PICTURA_CHECK(!camera.depth_m && !camera.class_id && !camera.instance_id,
                    "renderer {}: images: camera {}: only cpu and cuda support depth, class and instance planes", name_,
                    i);
    }
    if (interop_) {
      check_device(name_, "scene", device(), scene.device);
      interop_->copy_to_host(scene, views, stream, &host_scene_);
      draw(host_scene_.batch(), host_scene_.view_batch(), images_out, stream);
    } else {
      draw(scene, views, images_out, stream);
    }
  }

  void check(Stream stream) override {
    if (interop_) interop_->synchronize(stream);
  }

  void visibility(const SceneBatch&, const ViewBatch&, Span<const VisibilityQuery>, Span<float>, Stream) override {
    fail("renderer {}: only cpu and cuda support visibility", name_);
  }

 private:
  void make_pipeline() {
    program_ = gl::make_program(
        *gl_, {{GL_VERTEX_SHADER, gl::kFaceVertexShader}, {GL_FRAGMENT_SHADER, gl::kFaceFragmentShader}});
    projection_ = gl_->GetUniformLocation(program_, "projection");
    positions_ = gl_->GetUniformLocation(program_, "positions");
    positions_per_px_ = static_cast<float>(config_.samples.grid << gl_->integer(GL_SUBPIXEL_BITS));
    gl_->ProgramUniform1f(program_, gl_->GetUniformLocation(program_, "near_m"), kNear_m);
    gl_->ProgramUniform2f(program_, gl_->GetUniformLocation(program_, "inverse_depth"), gl::kMinInverseDepth,
                          gl::kMaxInverseDepth);
    gl_->CreateBuffers(1, &instances_);
    gl_->CreateVertexArrays(1, &vertex_array_);
    gl_->VertexArrayVertexBuffer(vertex_array_, 0, instances_, 0, sizeof(FaceInstance));
    gl_->VertexArrayBindingDivisor(vertex_array_, 0, 1);
    auto attribute = [&](GLuint location, int floats, std::size_t offset) {
      gl_->EnableVertexArrayAttrib(vertex_array_, location);
      gl_->VertexArrayAttribBinding(vertex_array_, location, 0);
      if (floats > 0) {
        gl_->VertexArrayAttribFormat(vertex_array_, location, floats, GL_FLOAT, GL_FALSE, static_cast<GLuint>(offset));
      } else {
        gl_->VertexArrayAttribIFormat(vertex_array_, location, 1, GL_INT, static_cast<GLuint>(offset));
      }
    };
    for (GLuint corner = 0; corner < 4; ++corner) {
      attribute(corner, 3, offsetof(FaceInstance, corner) + corner * sizeof(Vec3));
    }
    attribute(4, 3, offsetof(FaceInstance, compared_plane));
    attribute(5, 3, offsetof(FaceInstance, color));
    attribute(6, 0, offsetof(FaceInstance, layer));
    // The depth buffer stores inverse depth, 1 at the near plane and 0 at infinity, so that single precision suffices
    // at every range.
    gl_->ClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    gl_->Enable(GL_DEPTH_TEST);
    gl_->DepthFunc(GL_GREATER);
    gl::check_errors(*gl_, fmt::format("renderer {}: making the pipeline", name_));
  }

  std::vector<SizeGroup> make_groups() const {
    std::vector<SizeGroup> groups;
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
      auto same_size = [&](const SizeGroup& group) {
        const PinholeCamera& first = cameras_[group.cameras[0]];
        return first.width_px == cameras_[i].width_px && first.height_px == cameras_[i].height_px;
      };
      auto group = std::find_if(groups.begin(), groups.end(), same_size);
      if (group == groups.end()) {
        groups.push_back({{},
                          std::make_unique<gl::ImageArray>(*gl_, name_, config_.samples, interop_.get(),
                                                           cameras_[i].width_px, cameras_[i].height_px)});
        group = groups.end() - 1;
      }
      group->cameras.push_back(i);
    }
    return groups;
  }

  void draw(const SceneBatch& scene, const ViewBatch& batch, const ImageBatch& images_out, Stream stream) {
    const Span<const View> views = counted_views(name_, batch);
    check_scene(name_, scene, geometries_);
    check_views(name_, scene, views);
    if (views.empty()) return;
    const gl::CurrentContext current(context_.get());
    for (SizeGroup& group : groups_) {
      // Images are ordered by camera, so that each camera's views are consecutive.
      const int64_t total = static_cast<int64_t>(views.size() * group.cameras.size());
      const int layers = group.array->reserve(total, images_out.format);
      for (int64_t begin = 0; begin < total; begin += layers) {
        draw_images(group, begin, std::min(total, begin + layers), scene, views, images_out, stream);
      }
    }
    gl::check_errors(*gl_, fmt::format("renderer {}: drawing", name_));
  }

  // Draws images [begin, end) of a group. They must fit the group's array.
  void draw_images(const SizeGroup& group, int64_t begin, int64_t end, const SceneBatch& scene, Span<const View> views,
                   const ImageBatch& images_out, Stream stream) {
    const auto num_views = static_cast<int64_t>(views.size());
    const auto count = static_cast<std::size_t>(end - begin);
    if (faces_.size() < count) faces_.resize(count);
    parallel_for(config_.num_threads, end - begin, [&](int64_t i) {
      const View& view = views[(begin + i) % num_views];
      build_faces(camera_of(group.cameras[(begin + i) / num_views], view), scene, view, static_cast<int32_t>(i));
    });
    upload_faces(count);

    group.array->begin();
    gl_->UseProgram(program_);
    gl_->BindVertexArray(vertex_array_);
    copies_planned_.clear();
    for (int64_t image = begin; image < end;) {
      const std::size_t index = group.cameras[image / num_views];
      const int64_t view = image % num_views;
      // Views of one camera are drawn together if they have the same projection.
      const int64_t last = config_.randomization.moves_cameras() ? image + 1 : std::min(end, image + num_views - view);
      const auto layer = static_cast<std::size_t>(image - begin), end_layer = static_cast<std::size_t>(last - begin);
      project_by(camera_of(index, views[view]));
      gl_->DrawArraysInstancedBaseInstance(GL_TRIANGLE_STRIP, 0, 4,
                                           static_cast<GLsizei>(first_face_[end_layer] - first_face_[layer]),
                                           static_cast<GLuint>(first_face_[layer]));
      const CameraImages& out = images_out.cameras[index];
      void* const first = static_cast<std::byte*>(out.data) +
                          view * out.view_stride * static_cast<int64_t>(bytes_per_value(images_out.format));
      group.array->plan_copy(static_cast<int>(layer), static_cast<int>(end_layer - layer), first, out.view_stride,
                             &copies_planned_);
      image = last;
    }
    group.array->resolve(static_cast<int>(count));
    group.array->copy(copies_planned_, stream);
  }

  // Returns a camera of the rig, in the ego frame, as randomized for a view's agent.
  PinholeCamera camera_of(std::size_t index, const View& view) const {
    return randomized_camera(cameras_[index], config_.randomization, view.key, static_cast<int>(index));
  }

  void build_faces(const PinholeCamera& in_ego, const SceneBatch& scene, const View& view, int32_t layer) {
    const PinholeCamera camera = place_camera(in_ego, view);
    const GeometryHandle handle = scene.geometry[view.world];
    faces_[layer].build({camera, make_frustum(camera), config_.line_floor_px, config_.debug_palette},
                        *geometries_.find(handle), scene, view, layer);
  }

  // Uploads the faces of the first `count` images consecutively to the instance buffer.
  void upload_faces(std::size_t count) {
    first_face_.resize(count + 1);
    first_face_[0] = 0;
    for (std::size_t i = 0; i < count; ++i) first_face_[i + 1] = first_face_[i] + faces_[i].faces().size();
    const std::size_t bytes = first_face_[count] * sizeof(FaceInstance);
    if (bytes == 0) return;
    gl_->NamedBufferData(instances_, static_cast<GLsizeiptr>(bytes), nullptr, GL_STREAM_DRAW);
    auto* const mapped = static_cast<FaceInstance*>(
        gl_->MapNamedBufferRange(instances_, 0, static_cast<GLsizeiptr>(bytes), GL_MAP_WRITE_BIT));
    gl::check_errors(*gl_, fmt::format("renderer {}: allocating {} faces", name_, first_face_[count]));
    for (std::size_t i = 0; i < count; ++i) {
      std::copy(faces_[i].faces().begin(), faces_[i].faces().end(), mapped + first_face_[i]);
    }
    gl_->UnmapNamedBuffer(instances_);
  }

  // Sets the projection from camera coordinates to -1 to 1 across the image. The first row of the image is the lowest
  // row of the texture.
  void project_by(const PinholeCamera& camera) {
    const float width = static_cast<float>(camera.width_px), height = static_cast<float>(camera.height_px);
    gl_->ProgramUniform4f(program_, projection_, 2.0f * camera.focal_x_px / width, 2.0f * camera.focal_y_px / height,
                          2.0f * camera.center_x_px / width - 1.0f, 2.0f * camera.center_y_px / height - 1.0f);
    gl_->ProgramUniform2f(program_, positions_, 0.5f * positions_per_px_ * width, 0.5f * positions_per_px_ * height);
  }

  RendererConfig config_;
  std::vector<PinholeCamera> cameras_;  // in the ego frame
  std::unique_ptr<gl::Context> context_;
  std::unique_ptr<gl::CudaInterop> interop_;  // not null if scenes and images are in device memory
  Device memory_;                             // device of scenes and images
  std::string name_, drawn_by_;
  std::unique_ptr<gl::Functions> gl_;
  std::vector<SizeGroup> groups_;
  GLuint program_ = 0, instances_ = 0, vertex_array_ = 0;
  GLint projection_ = -1, positions_ = -1;
  float positions_per_px_ = 0;  // number of corner positions per pixel that the driver distinguishes, along each axis
  HostGeometries geometries_;
  gl::HostScene host_scene_;
  std::vector<gl::ImageFaces> faces_;    // one per layer
  std::vector<std::size_t> first_face_;  // [layers + 1] first face of each layer in the buffer
  std::vector<gl::RowCopy> copies_planned_;
};

std::unique_ptr<gl::CudaInterop> interop_for(const std::string& name, Device device) {
  if (device.is_host()) return nullptr;
  PICTURA_CHECK(name != "gl:osmesa", "renderer gl:osmesa: draws only in host memory; use gl:egl for device memory");
#ifdef PICTURA_HAS_CUDA
  return gl::make_cuda_interop(device);
#else
  fail("renderer {}: images in device memory: this build has no CUDA", name);
#endif
}

}  // namespace

std::unique_ptr<Renderer> make_gl_renderer(const std::string& name, const RendererConfig& config,
                                           std::string* choice_out) {
  check_config(name, config);
  auto interop = interop_for(name, config.device);
  const int cuda_device = interop ? interop->device().index : -1;
  std::unique_ptr<gl::Context> context;
  std::string why = "requested";
  if (name == "gl:osmesa") {
    context = gl::make_osmesa_context();
  } else if (name == "gl:egl" || interop) {
    context = gl::make_egl_context(cuda_device);
  } else {
    try {
      context = gl::make_egl_context();
      why = "EGL gives a context";
    } catch (const Error& no_egl) {
      why = no_egl.what();
      try {
        context = gl::make_osmesa_context();
      } catch (const Error& no_osmesa) {
        fail("{}; {}", no_egl.what(), no_osmesa.what());
      }
    }
  }
  const std::string chosen = context->name();
  auto renderer = std::make_unique<GlRenderer>(config, std::move(context), std::move(interop));
  if (choice_out) *choice_out = fmt::format("{}: {}; on {}", chosen, why, renderer->drawn_by());
  return renderer;
}

}  // namespace pictura
