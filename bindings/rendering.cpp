// Cameras, rigs, scenes, images and renderers in Python.
#include <cmath>
#include <optional>

#include <pybind11/stl.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/bindings/call.h"
#include "pictura/bindings/objects.h"
#include "pictura/bindings/options.h"
#include "pictura/bindings/owned_memory.h"
#include "pictura/common/pixel_samples.h"
#include "pictura/common/scene_file.h"

namespace pictura::python {

namespace {

using FloatTable = py::array_t<float, py::array::c_style | py::array::forcecast>;
using IntTable = py::array_t<int32_t, py::array::c_style | py::array::forcecast>;

void check_shape(const py::array& array, std::string_view what, py::ssize_t rows, py::ssize_t columns) {
  const bool fits = columns == 0 ? array.ndim() == 1 && array.shape(0) == rows
                                 : array.ndim() == 2 && array.shape(0) == rows && array.shape(1) == columns;
  PICTURA_CHECK(fits, "{}: expected [{}{}], got {} dimensions, {} elements", what, rows,
                columns == 0 ? "" : fmt::format(", {}", columns), array.ndim(), array.size());
}

std::shared_ptr<Scene> scene_of(std::shared_ptr<SceneOwner> owner) {
  auto scene = std::make_shared<Scene>();
  scene->batch = [raw = owner.get()] { return raw->batch(); };
  scene->owner = std::move(owner);
  return scene;
}

std::shared_ptr<Scene> make_scene(const FloatTable& center_m, const FloatTable& heading_rad, const FloatTable& size_m,
                                  const IntTable& agent_class, const std::optional<IntTable>& world_begin,
                                  const std::optional<IntTable>& geometry, const std::optional<IntTable>& light_states,
                                  const std::optional<IntTable>& light_begin) {
  const py::ssize_t n = heading_rad.size();
  check_shape(center_m, "Scene: center_m", n, 3);
  check_shape(heading_rad, "Scene: heading_rad", n, 0);
  check_shape(size_m, "Scene: size_m", n, 3);
  check_shape(agent_class, "Scene: agent_class", n, 0);
  auto owner = std::make_shared<SceneOwner>();
  for (py::ssize_t i = 0; i < n; ++i) {
    const int32_t its_class = agent_class.at(i);
    PICTURA_CHECK(its_class >= 0 && its_class < kNumAgentClasses,
                  "Scene: agent_class: box {}: expected 0 to {}, got {}", i, kNumAgentClasses - 1, its_class);
    owner->agents.push_back(make_box(static_cast<AgentClass>(its_class),
                                     {center_m.at(i, 0), center_m.at(i, 1), center_m.at(i, 2)}, heading_rad.at(i),
                                     {size_m.at(i, 0), size_m.at(i, 1), size_m.at(i, 2)}));
  }
  const auto copy = [](const std::optional<IntTable>& from, std::vector<int32_t> otherwise) {
    return from ? std::vector<int32_t>(from->data(), from->data() + from->size()) : std::move(otherwise);
  };
  owner->world_begin = copy(world_begin, {0, static_cast<int32_t>(n)});
  const size_t num_worlds = owner->world_begin.empty() ? 0 : owner->world_begin.size() - 1;
  owner->geometry = copy(geometry, std::vector<int32_t>(num_worlds, 0));
  for (const int32_t state : copy(light_states, {})) {
    PICTURA_CHECK(state >= 0 && state < kNumLightStates,
                  "Scene: light_states: expected 0 (off) to {} (unknown), got {}", kNumLightStates - 1, state);
    owner->light_states.push_back(static_cast<LightState>(state));
  }
  owner->light_begin = copy(light_begin, std::vector<int32_t>(num_worlds + 1, 0));
  return scene_of(std::move(owner));
}

py::array view_array(const std::vector<View>& views) {
  const py::dtype type = py::module_::import("pictura._pictura").attr("VIEW_DTYPE");
  py::array array(type, static_cast<py::ssize_t>(views.size()));
  if (!views.empty()) std::memcpy(array.mutable_data(), views.data(), views.size() * sizeof(View));
  return array;
}

py::array make_views(const FloatTable& origin_m, const FloatTable& heading_rad, const std::optional<IntTable>& world,
                     const std::optional<IntTable>& ego_agent, const std::optional<FloatTable>& body_length_m) {
  const py::ssize_t n = heading_rad.size();
  check_shape(origin_m, "make_views: origin_m", n, 3);
  std::vector<View> views;
  for (py::ssize_t i = 0; i < n; ++i) {
    View view = make_view({origin_m.at(i, 0), origin_m.at(i, 1), origin_m.at(i, 2)}, heading_rad.at(i));
    if (world) check_shape(*world, "make_views: world", n, 0), view.world = world->at(i);
    if (ego_agent) check_shape(*ego_agent, "make_views: ego_agent", n, 0), view.ego_agent = ego_agent->at(i);
    if (body_length_m) {
      check_shape(*body_length_m, "make_views: body_length_m", n, 0);
      view.body_length_m = body_length_m->at(i);
    }
    views.push_back(view);
  }
  return view_array(views);
}

PixelFormat format_of(const std::string& name) {
  if (name == "uint8") return PixelFormat::u8;
  if (name == "float16") return PixelFormat::f16;
  if (name == "float32") return PixelFormat::f32;
  fail_usage("images: dtype: expected 'uint8', 'float16' or 'float32', got '{}'", name);
}
ElementType element_of(PixelFormat format) {
  switch (format) {
    case PixelFormat::u8: return ElementType::u8;
    case PixelFormat::f16: return ElementType::f16;
    case PixelFormat::bf16: return ElementType::bf16;
    default: return ElementType::f32;
  }
}

/// Images, with depth, class and instance planes if requested, in one block of memory.
class Images {
 public:
  Images(const Rig& rig, int64_t num_views, PixelFormat format, bool planes, Device device, Stream stream)
      : layout_(image_layout(rig, num_views, format)), device_(device), stream_(stream) {
    size_t plane_pixels = 0;
    for (const CameraLayout& camera : layout_.cameras) {
      plane_pixels += static_cast<size_t>(num_views * camera.size.pixels());
    }
    if (!planes) plane_pixels = 0;
    // Arrays with larger elements come first, so that all arrays are aligned.
    const size_t depth_bytes = plane_pixels * sizeof(float), instance_bytes = plane_pixels * sizeof(uint16_t);
    const size_t color_bytes = (layout_.bytes() + 7) / 8 * 8;
    uint8_t* at = memory_.allocate(color_bytes + depth_bytes + instance_bytes + plane_pixels, device_, "images");
    first_ = at;
    float* depth = reinterpret_cast<float*>(at + color_bytes);
    auto* instance = reinterpret_cast<uint16_t*>(at + color_bytes + depth_bytes);
    uint8_t* class_id = at + color_bytes + depth_bytes + instance_bytes;
    for (size_t i = 0; i < layout_.cameras.size(); ++i) {
      cameras_.push_back(camera_images(layout_, static_cast<int>(i), first_));
      if (!planes) continue;
      const auto pixels = static_cast<size_t>(num_views * layout_.cameras[i].size.pixels());
      cameras_.back().depth_m = std::exchange(depth, depth + pixels);
      cameras_.back().instance_id = std::exchange(instance, instance + pixels);
      cameras_.back().class_id = std::exchange(class_id, class_id + pixels);
    }
  }

  ImageBatch batch() const {
    ImageBatch batch;
    batch.device = device_;
    batch.format = layout_.format;
    batch.num_views = static_cast<int>(layout_.num_views);
    batch.cameras = cameras_;
    return batch;
  }
  const ImageLayout& layout() const { return layout_; }
  bool has_planes() const { return !cameras_.empty() && cameras_[0].depth_m; }

  static LentArray block(const std::shared_ptr<Images>& self, size_t index) {
    const BlockLayout& block = self->layout_.blocks[index];
    const Dims shape{self->layout_.num_views, static_cast<int64_t>(block.cameras.size()), 3, block.size.height_px,
                     block.size.width_px};
    return self->lend(self, self->first_ + block.offset * static_cast<int64_t>(bytes_per_value(self->layout_.format)),
                      element_of(self->layout_.format), shape, "images");
  }
  static LentArray camera(const std::shared_ptr<Images>& self, size_t index) {
    const CameraLayout& camera = self->layout_.cameras[index];
    LentArray lent =
        self->lend(self, self->cameras_[index].data, element_of(self->layout_.format),
                   {self->layout_.num_views, 3, camera.size.height_px, camera.size.width_px}, "images of a camera");
    lent.array.strides[0] = camera.view_stride;
    return lent;
  }
  static LentArray plane(const std::shared_ptr<Images>& self, size_t index, ElementType type, void* data,
                         const char* what) {
    PICTURA_CHECK(data, "images: made without planes: pass planes=True");
    const CameraLayout& camera = self->layout_.cameras[index];
    return self->lend(self, data, type, {self->layout_.num_views, camera.size.height_px, camera.size.width_px}, what);
  }
  const CameraImages& memory(size_t camera) const { return cameras_[camera]; }

 private:
  LentArray lend(const std::shared_ptr<Images>& self, void* data, ElementType type, Dims shape, const char* what) {
    return {Array(data, type, shape, device_), self, stream_, false, what};
  }

  ImageLayout layout_;
  Device device_;
  Stream stream_;
  OwnedMemory memory_;
  uint8_t* first_ = nullptr;
  std::vector<CameraImages> cameras_;
};

/// Returns the memory for the views from `first` on.
std::vector<CameraImages> images_from(const ImageBatch& batch, int64_t first) {
  std::vector<CameraImages> cameras(batch.cameras.begin(), batch.cameras.end());
  for (CameraImages& camera : cameras) {
    const int64_t plane_pixels = first * camera.width_px * camera.height_px;
    camera.data = static_cast<uint8_t*>(camera.data) +
                  first * camera.view_stride * static_cast<int64_t>(bytes_per_value(batch.format));
    if (camera.depth_m) camera.depth_m += plane_pixels;
    if (camera.class_id) camera.class_id += plane_pixels;
    if (camera.instance_id) camera.instance_id += plane_pixels;
  }
  return cameras;
}

/// pictura.Renderer: a renderer with the stream of its work.
class PyRenderer {
 public:
  PyRenderer(const std::string& name, const RendererConfig& config, Stream stream)
      : renderer_(make_renderer(name, config, &choice_)),
        calls_(config.num_threads, renderer_->device()),
        stream_(stream) {
    check_device("Renderer", config.device, renderer_->device(), choice_);
  }
  explicit PyRenderer(std::shared_ptr<Renderer> renderer)
      : renderer_(std::move(renderer)), calls_(renderer_->config().num_threads, renderer_->device()) {}

  RendererInside inside() const { return {renderer_, calls_.call_guard()}; }
  Renderer& renderer() { return *renderer_; }
  Calls& calls() { return calls_; }
  Stream stream() const { return stream_; }
  void set_stream(Stream stream) { stream_ = stream; }
  const std::string& choice() const { return choice_; }

  py::object render(const Scene& scene, const py::object& views, const py::object& out, const std::string& dtype,
                    bool planes) {
    BorrowedArray borrowed_views = borrow_structs(views, "render: views", sizeof(View), stream_), borrowed_out;
    py::object images = draw_into(scene, views_of(borrowed_views), out, dtype, planes, &borrowed_out);
    if (!renderer_->device().is_host()) {
      kept_views_ = std::move(borrowed_views);
      kept_out_ = std::move(borrowed_out);
    }
    return images;
  }

  py::array_t<float> visibility(const Scene& scene, const py::object& views, const IntTable& queries) {
    PICTURA_CHECK(renderer_->device().is_host(), "visibility: expected a renderer on cpu, got one on {}",
                  name_of(renderer_->device()));
    const BorrowedArray borrowed = borrow_structs(views, "visibility: views", sizeof(View), stream_);
    const Span<const View> span = views_of(borrowed);
    PICTURA_CHECK(queries.ndim() == 2 && queries.shape(1) == 2,
                  "visibility: queries: expected [n, 2]: index of the view, index of the agent in the scene");
    std::vector<VisibilityQuery> list;
    for (py::ssize_t i = 0; i < queries.shape(0); ++i) list.push_back({queries.at(i, 0), queries.at(i, 1)});
    py::array_t<float> answers(static_cast<py::ssize_t>(list.size()));
    const Span<float> out(answers.mutable_data(), list.size());
    calls_.run("visibility", [&] { renderer_->visibility(scene.batch(), span, list, out, stream_); });
    return answers;
  }

 private:
  Span<const View> views_of(const BorrowedArray& borrowed) const {
    const Array& array = borrowed.array();
    PICTURA_CHECK(array.shape.rank() == 2, "views: expected structs of VIEW_DTYPE or u8 [n, {}], got {}", sizeof(View),
                  array.text());
    const auto bytes = array.checked<const uint8_t>("views", {array.shape[0], static_cast<int64_t>(sizeof(View))},
                                                    renderer_->device());
    PICTURA_CHECK(reinterpret_cast<uintptr_t>(bytes.data()) % alignof(View) == 0, "views: expected aligned memory");
    return {reinterpret_cast<const View*>(bytes.data()), static_cast<size_t>(array.shape[0])};
  }
  /// Draws views. On the host, draws them in batches and handles ^C between batches, because the images of a view do
  /// not depend on other views.
  void draw(const Scene& scene, Span<const View> views, const ImageBatch& batch) {
    // Preparing an image takes about as long as drawing kPixelsOfSetup pixels. Drawing kPixelsAtATime pixels takes
    // about 0.1 s on one core.
    constexpr int64_t kPixelsOfSetup = 4096, kPixelsAtATime = int64_t{1} << 22;
    int64_t pixels_per_view = 0;
    for (const Camera& camera : renderer_->config().rig.cameras) {
      pixels_per_view += int64_t{camera.width_px} * camera.height_px + kPixelsOfSetup;
    }
    const auto all = static_cast<int64_t>(views.size());
    const int64_t step = batch.device.is_host() ? std::max<int64_t>(1, kPixelsAtATime / pixels_per_view) : all;
    if (step >= all) {
      calls_.run("render", [&] { renderer_->render(scene.batch(), views, batch, stream_); });
      return;
    }
    PICTURA_CHECK(batch.num_views == all, "render: expected images of {} views, got {}", all, batch.num_views);
    for (int64_t begin = 0; begin < all; begin += step) {
      const int64_t count = std::min(step, all - begin);
      const std::vector<CameraImages> cameras = images_from(batch, begin);
      ImageBatch some = batch;
      some.num_views = static_cast<int>(count);
      some.cameras = cameras;
      const Span<const View> span(views.data() + begin, static_cast<size_t>(count));
      calls_.run("render", [&] {
        try {
          renderer_->render(scene.batch(), span, some, stream_);
        } catch (const Error& error) {
          fail("views {} to {}: {}", begin, begin + count - 1, error.what());
        }
      });
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    }
  }

  /// Draws to `out`, which is a pictura.Images or another array of the caller, or to new images if it is None.
  /// *borrowed_out gets the access to a caller's array.
  py::object draw_into(const Scene& scene, Span<const View> span, const py::object& out, const std::string& dtype,
                       bool planes, BorrowedArray* borrowed_out) {
    if (py::isinstance<Images>(out)) {
      draw(scene, span, py::cast<Images&>(out).batch());
      return out;
    }
    const auto num_views = static_cast<int64_t>(span.size());
    if (out.is_none()) {
      auto images = std::make_shared<Images>(renderer_->config().rig, num_views, format_of(dtype), planes,
                                             renderer_->device(), stream_);
      draw(scene, span, images->batch());
      return py::cast(images);
    }
    // `out` is another array of the caller, which requires cameras of one image size.
    *borrowed_out = borrow(out, "render: out", stream_);
    const Array& array = borrowed_out->array();
    const PixelFormat format = array.type == ElementType::f32    ? PixelFormat::f32
                               : array.type == ElementType::f16  ? PixelFormat::f16
                               : array.type == ElementType::bf16 ? PixelFormat::bf16
                                                                 : PixelFormat::u8;
    const ImageLayout layout = image_layout(renderer_->config().rig, num_views, format);
    PICTURA_CHECK(layout.blocks.size() == 1,
                  "render: out: expected pictura.Images, since the cameras have {} different sizes",
                  layout.blocks.size());
    const ImageSize size = layout.blocks[0].size;
    const Dims shape{num_views, static_cast<int64_t>(layout.cameras.size()), 3, size.height_px, size.width_px};
    void* first = nullptr;
    switch (format) {
      case PixelFormat::u8: first = array.checked<uint8_t>("render: out", shape, renderer_->device()).data(); break;
      case PixelFormat::f32: first = array.checked<float>("render: out", shape, renderer_->device()).data(); break;
      case PixelFormat::f16:
      case PixelFormat::bf16: {
        PICTURA_CHECK(
            array.shape == shape && array.device == renderer_->device() && array.is_contiguous() && !array.is_read_only,
            "render: out: expected {} {} on {}, writable, got {}", name_of(array.type), shape.text(),
            name_of(renderer_->device()), array.text());
        first = array.data;
      }
    }
    std::vector<CameraImages> cameras;
    for (size_t i = 0; i < layout.cameras.size(); ++i) {
      cameras.push_back(camera_images(layout, static_cast<int>(i), first));
    }
    ImageBatch batch;
    batch.device = renderer_->device();
    batch.format = format;
    batch.num_views = static_cast<int>(num_views);
    batch.cameras = cameras;
    draw(scene, span, batch);
    return out;
  }

  std::string choice_;
  std::shared_ptr<Renderer> renderer_;
  Calls calls_;
  Stream stream_;
  // Arrays of the last call. Work on a device may still read and write them.
  BorrowedArray kept_views_, kept_out_;
};

PixelSamples samples_of(const std::string& text) {
  if (text.empty()) return {};
  const std::optional<PixelSamples> samples = parse_pixel_samples(text);
  if (!samples) fail_usage("Renderer: samples: expected {}, got '{}'", kPixelSamplesExpected, text);
  return *samples;
}

}  // namespace

void check_device(std::string_view what, Device wanted, Device given, std::string_view choice) {
  PICTURA_CHECK(wanted.is_host() || !given.is_host(), "{}: expected device '{}', got {}", what, name_of(wanted),
                choice);
}

Stream stream_of(const py::object& handle) {
  if (handle.is_none()) return {};
  const auto address = cast_checked<int64_t>(handle, "stream", "a cudaStream_t as int, or None");
  return {reinterpret_cast<void*>(static_cast<intptr_t>(address))};
}

namespace {

void bind_dtypes(py::module_& module) {
  const py::object dtype = py::module_::import("numpy").attr("dtype");
  const auto field = [](const char* name, const char* type) { return py::make_tuple(name, type); };
  py::list fields;
  fields.append(field("world", "<i4"));
  fields.append(field("ego_agent", "<i4"));
  fields.append(py::make_tuple("origin_m", "<f4", py::make_tuple(3)));
  for (const char* name : {"cos_heading", "sin_heading", "body_length_m"}) fields.append(field(name, "<f4"));
  for (const char* name : {"hidden_begin", "hidden_end"}) fields.append(field(name, "<i4"));
  fields.append(field("hides", "<u4"));
  py::list key;
  for (const char* name : {"world", "agent", "episode", "step"}) key.append(field(name, "<u4"));
  fields.append(py::make_tuple("key", dtype(key)));
  module.attr("VIEW_DTYPE") = dtype(fields);
  PICTURA_CHECK(py::cast<size_t>(module.attr("VIEW_DTYPE").attr("itemsize")) == sizeof(View), "a view's layout");
  py::list box;
  box.append(py::make_tuple("center_m", "<f4", py::make_tuple(3)));
  for (const char* name : {"cos_heading", "sin_heading", "length_m", "width_m", "height_m"})
    box.append(field(name, "<f4"));
  for (const char* name : {"agent_class", "palette", "drawn", "padding"}) box.append(field(name, "u1"));
  module.attr("BOX_DTYPE") = dtype(box);
  PICTURA_CHECK(py::cast<size_t>(module.attr("BOX_DTYPE").attr("itemsize")) == sizeof(AgentBox), "a box's layout");
}

void bind_rig(py::module_& module) {
  py::class_<Camera>(module, "Camera", R"(
Pinhole camera on a body. Its position is in metres from the rig's origin: x forward, y left, z up. Angles are in
radians. Positive yaw is counter-clockwise, positive pitch looks up, and positive roll is clockwise as seen from behind.

Examples:
    >>> roof = pictura.Camera('roof', 128, 72, position_m=(1.0, 0.0, 1.6), pitch_rad=-0.1)
    >>> roof.focal_x_px
    102.4000015258789)")
      .def(py::init([](const std::string& name, int width_px, int height_px, std::optional<float> focal_px,
                       std::array<float, 3> position_m, float yaw_rad, float pitch_rad, float roll_rad) {
             Camera camera;
             camera.name = name;
             camera.width_px = width_px;
             camera.height_px = height_px;
             camera.focal_x_px = camera.focal_y_px = focal_px.value_or(0.8f * static_cast<float>(width_px));
             camera.center_x_px = 0.5f * static_cast<float>(width_px);
             camera.center_y_px = 0.5f * static_cast<float>(height_px);
             camera.position_m = {position_m[0], position_m[1], position_m[2]};
             camera.yaw_rad = yaw_rad;
             camera.pitch_rad = pitch_rad;
             camera.roll_rad = roll_rad;
             return camera;
           }),
           py::arg("name"), py::arg("width_px"), py::arg("height_px"), py::kw_only(), py::arg("focal_px") = py::none(),
           py::arg("position_m") = std::array<float, 3>{1.5f, 0, 1.5f}, py::arg("yaw_rad") = 0.0f,
           py::arg("pitch_rad") = 0.0f, py::arg("roll_rad") = 0.0f,
           "The principal point is the middle of the image. The default of focal_px is 0.8 times the width, a "
           "horizontal field of view of about 64 degrees.")
      .def_readwrite("name", &Camera::name)
      .def_readwrite("width_px", &Camera::width_px)
      .def_readwrite("height_px", &Camera::height_px)
      .def_readwrite("focal_x_px", &Camera::focal_x_px)
      .def_readwrite("focal_y_px", &Camera::focal_y_px)
      .def_readwrite("center_x_px", &Camera::center_x_px)
      .def_readwrite("center_y_px", &Camera::center_y_px)
      .def_property(
          "position_m",
          [](const Camera& c) { return std::array<float, 3>{c.position_m.x, c.position_m.y, c.position_m.z}; },
          [](Camera& c, std::array<float, 3> p) { c.position_m = {p[0], p[1], p[2]}; })
      .def_readwrite("yaw_rad", &Camera::yaw_rad)
      .def_readwrite("pitch_rad", &Camera::pitch_rad)
      .def_readwrite("roll_rad", &Camera::roll_rad)
      .def(py::pickle(
          [](const Camera& c) {
            return py::make_tuple(c.name, c.width_px, c.height_px, c.focal_x_px, c.focal_y_px, c.center_x_px,
                                  c.center_y_px, c.position_m.x, c.position_m.y, c.position_m.z, c.yaw_rad, c.pitch_rad,
                                  c.roll_rad);
          },
          [](const py::tuple& t) {
            PICTURA_CHECK(t.size() == 13, "Camera: expected 13 values, got {}", t.size());
            Camera c;
            c.name = py::cast<std::string>(t[0]);
            c.width_px = py::cast<int>(t[1]);
            c.height_px = py::cast<int>(t[2]);
            float* const floats[] = {&c.focal_x_px,   &c.focal_y_px,   &c.center_x_px, &c.center_y_px, &c.position_m.x,
                                     &c.position_m.y, &c.position_m.z, &c.yaw_rad,     &c.pitch_rad,   &c.roll_rad};
            for (size_t i = 0; i < std::size(floats); ++i) *floats[i] = py::cast<float>(t[i + 3]);
            return c;
          }))
      .def("__repr__", [](const Camera& c) {
        return fmt::format("<pictura.Camera {}: {}x{} px>", c.name, c.width_px, c.height_px);
      });

  const auto made = [](std::vector<Camera> cameras) {
    Rig rig{std::move(cameras)};
    validate(rig);
    return rig;
  };
  py::class_<Rig>(module, "Rig", R"(
One or more cameras on a body, in the order of their images. Cameras may have different image sizes.

Examples:
    >>> [camera.name for camera in pictura.Rig.paper(96, 54).cameras]
    ['front', 'front_left', 'front_right', 'back']
    >>> len(pictura.Rig([pictura.Camera('front', 64, 36, position_m=(1.5, 0, 1.4))]))
    1)")
      .def(py::init(made), py::arg("cameras"),
           "Creates a rig of 1 to 64 cameras. Raises pictura.Error for another number or an invalid camera.")
      .def_static("paper", paper_rig, py::arg("width_px") = 96, py::arg("height_px") = 54,
                  py::arg("square_pixels") = false,
                  "Returns the paper's four cameras: front, front left, front right and back. Image sizes are from 1 "
                  "to 8192 px.")
      .def_static("load", load_rig, py::arg("path"),
                  "Reads a rig from a TOML file. Raises pictura.Error, which names file, camera and key.")
      .def_readonly("cameras", &Rig::cameras)
      .def(py::pickle([](const Rig& rig) { return py::make_tuple(rig.cameras); },
                      [made](const py::tuple& t) { return made(py::cast<std::vector<Camera>>(t[0])); }))
      .def("__len__", [](const Rig& rig) { return rig.cameras.size(); });
}

void bind_scene(py::module_& module) {
  py::class_<Scene, std::shared_ptr<Scene>>(module, "Scene", R"(
Dynamic objects of one or more worlds: boxes of agents and states of traffic lights. Simulator.scene always shows the
simulator's current state. A scene created from arrays has a copy of them.

Examples:
    >>> car = pictura.Scene(center_m=[[12, 0, 0]], heading_rad=[0], size_m=[[4.4, 1.8, 1.5]], agent_class=[0])
    >>> car.num_worlds, car.boxes.shape
    (1, (1, 36)))")
      .def(py::init(&make_scene), py::arg("center_m"), py::arg("heading_rad"), py::arg("size_m"),
           py::arg("agent_class"), py::kw_only(), py::arg("world_begin") = py::none(), py::arg("geometry") = py::none(),
           py::arg("light_states") = py::none(), py::arg("light_begin") = py::none(),
           R"(Creates a scene from arrays.

Args:
    center_m: [n, 3], centres of the boxes' feet, in metres.
    heading_rad: [n], headings in radians.
    size_m: [n, 3], length, width and height of boxes, in metres.
    agent_class: [n], 0 vehicle, 1 cyclist, 2 pedestrian.
    world_begin: [worlds + 1], index of the first box of each world, followed by n; default: a single world.
    geometry: [worlds], handle of each world's geometry, as in Renderer.upload(); default: 0.
    light_states: States of the lights of all worlds: 0 off, 1 red, 2 yellow, 3 green, 4 unknown.
    light_begin: [worlds + 1], index of the first light of each world, followed by the number of lights.

Raises:
    pictura.Error: An array has another shape. Inconsistent arrays raise the error later, in render().)")
      .def_property_readonly(
          "num_worlds", [](const Scene& self) { return self.batch().geometry.size(); }, py::doc("Number of worlds."))
      .def_property_readonly(
          "boxes",
          [](const Scene& self) {
            const SceneBatch batch = self.batch();
            LentArray lent{Array(reinterpret_cast<const uint8_t*>(batch.agents.data()),
                                 {static_cast<int64_t>(batch.agents.size()), static_cast<int64_t>(sizeof(AgentBox))},
                                 batch.device),
                           self.owner, self.stream, false, "scene boxes"};
            return lent;
          },
          py::doc("Boxes, read-only, uint8 [boxes, 36]. `numpy.asarray(boxes).view(BOX_DTYPE)[:, 0]` has the fields by "
                  "name."));

  py::class_<SceneFile>(module, "SceneFile", R"(
Scene in a TOML file: geometry, boxes, rig and views.

Examples:
    >>> text = '''size_px = [96, 54]
    ... [[view]]
    ... x_m = 0.0
    ... y_m = 0.0
    ... heading_deg = 0.0
    ... '''
    >>> _ = pathlib.Path('empty.toml').write_text(text)
    >>> pictura.SceneFile('empty.toml').view_names
    ['view0'])")
      .def(py::init(&load_scene), py::arg("path"),
           "Reads a scene file. Raises pictura.Error, which names file, line, table and key.")
      .def_property_readonly("rig", [](const SceneFile& self) { return self.config.rig; })
      .def_property_readonly("line_floor_px", [](const SceneFile& self) { return self.config.line_floor_px; })
      .def_property_readonly(
          "geometry",
          [](const SceneFile& self) { return Geometry{std::make_shared<const StaticGeometry>(self.geometry)}; })
      .def_property_readonly(
          "scene", [](const SceneFile& self) { return scene_of(std::make_shared<SceneOwner>(self.scene)); },
          py::doc("Scene of one world, whose geometry has the handle 0."))
      .def_property_readonly(
          "views", [](const SceneFile& self) { return view_array(self.views); }, py::doc("VIEW_DTYPE [n]."))
      .def_readonly("view_names", &SceneFile::view_names);

  module.def("make_views", make_views, py::arg("origin_m"), py::arg("heading_rad"), py::kw_only(),
             py::arg("world") = py::none(), py::arg("ego_agent") = py::none(), py::arg("body_length_m") = py::none(),
             R"(Returns views (poses of a rig) as a NumPy array of VIEW_DTYPE [n].

Args:
    origin_m: [n, 3], origins of the rig on the ground, in metres.
    heading_rad: [n], headings in radians.
    world: [n], indices of worlds; default: 0.
    ego_agent: [n], index of the box in the scene that is not drawn in the view; -1: none.
    body_length_m: [n], lengths of the bodies that carry the rig. Bodies shorter than 4.5 m move the cameras closer to
        the origin.

Raises:
    pictura.Error: An array has another shape.

Examples:
    >>> pictura.make_views(origin_m=[[0, 0, 0], [5, 0, 0]], heading_rad=[0, 1.5]).shape
    (2,))");
}

void bind_images(py::module_& module) {
  py::class_<Images, std::shared_ptr<Images>>(module, "Images", R"(
Images of several views by all cameras of a rig, in the renderer's memory. They may have planes: depth, class and
instance of each pixel. A renderer can draw into the same images repeatedly.

Examples:
    >>> renderer = pictura.Renderer('cpu', pictura.Rig.paper(32, 18))
    >>> images = renderer.make_images(num_views=5)
    >>> images.rgb.shape, images.camera(0).shape
    ((5, 4, 3, 18, 32), (5, 3, 18, 32)))")
      .def_property_readonly(
          "num_views", [](const Images& self) { return self.layout().num_views; },
          py::doc("Number of views for which memory is allocated."))
      .def_property_readonly(
          "rgb",
          [](const std::shared_ptr<Images>& self) {
            PICTURA_CHECK(self->layout().blocks.size() == 1,
                          "images: rgb: expected cameras of one size, got {} sizes: use blocks or cameras",
                          self->layout().blocks.size());
            return Images::block(self, 0);
          },
          py::doc("[views, cameras, 3, height, width], for a rig whose cameras have the same image size."))
      .def_property_readonly(
          "blocks",
          [](const std::shared_ptr<Images>& self) {
            py::list blocks;
            for (size_t i = 0; i < self->layout().blocks.size(); ++i) blocks.append(Images::block(self, i));
            return blocks;
          },
          py::doc("Arrays [views, cameras, 3, height, width], one for the cameras of each image size."))
      .def(
          "camera",
          [](const std::shared_ptr<Images>& self, size_t index) {
            PICTURA_CHECK(index < self->layout().cameras.size(), "images: expected a camera in [0, {}), got {}",
                          self->layout().cameras.size(), index);
            return Images::camera(self, index);
          },
          py::arg("index"), "Returns the images of one camera, [views, 3, height, width].")
      .def(
          "planes",
          [](const std::shared_ptr<Images>& self, size_t index) {
            PICTURA_CHECK(index < self->layout().cameras.size(), "images: expected a camera in [0, {}), got {}",
                          self->layout().cameras.size(), index);
            const CameraImages& memory = self->memory(index);
            py::dict planes;
            planes["depth_m"] = Images::plane(self, index, ElementType::f32, memory.depth_m, "depth");
            planes["class_id"] = Images::plane(self, index, ElementType::u8, memory.class_id, "class");
            planes["instance_id"] = Images::plane(self, index, ElementType::u16, memory.instance_id, "instance");
            return planes;
          },
          py::arg("camera"),
          R"(Returns planes [views, height, width], which describe the visible surface at each pixel's centre: depth_m float32
(infinite if there is no surface), class_id uint8 (0: none), instance_id uint16 (1 + the agent's index in its world; 0:
no agent). Raises pictura.Error for images without planes.)");
}

void bind_renderer(py::module_& module) {
  py::class_<RendererInside>(module, "_RendererInside");
  py::class_<PyRenderer>(module, "Renderer", R"(
Renderer of scenes. Only one thread at a time may use a renderer; different renderers are independent. On CUDA, work is
enqueued on `stream`.

Examples:
    >>> simulator = pictura.Simulator([pictura.Map.load('procedural:3')], [(0, 4)])
    >>> renderer = pictura.Renderer('cpu', pictura.Rig.paper(32, 18))
    >>> for handle, geometry in simulator.geometries.items():
    ...     renderer.upload(handle, geometry)
    >>> images = renderer.render(simulator.scene, simulator.views)
    >>> images.rgb.numpy().shape                    # views, cameras, channels, height, width
    (4, 4, 3, 18, 32))")
      .def(py::init([](const std::string& name, const std::optional<Rig>& rig, const std::string& device,
                       int num_threads, float line_floor_px, bool debug_palette, const std::string& samples,
                       double camera_severity, const py::object& stream) {
             RendererConfig config;
             if (rig) config.rig = *rig;
             config.device = device_of(device);
             config.num_threads = num_threads;
             config.line_floor_px = line_floor_px;
             config.debug_palette = debug_palette;
             config.samples = samples_of(samples);
             if (!(camera_severity >= 0 && camera_severity <= kMaxCameraSeverity)) {
               fail_usage("Renderer: camera_severity: expected 0 to {}, got {}", kMaxCameraSeverity, camera_severity);
             }
             config.randomization = scaled(kFullCameraSeverity, camera_severity);
             check_process("Renderer", num_threads, config.device);
             return std::make_unique<PyRenderer>(name, config, stream_of(stream));
           }),
           py::arg("name") = "auto", py::arg("rig") = py::none(), py::kw_only(), py::arg("device") = "cpu",
           py::arg("num_threads") = 0, py::arg("line_floor_px") = RendererConfig{}.line_floor_px,
           py::arg("debug_palette") = false, py::arg("samples") = "1", py::arg("camera_severity") = 0.0,
           py::arg("stream") = py::none(),
           R"(Creates a renderer.

Args:
    name: 'cpu', 'cuda', 'gl' ('gl:egl', 'gl:osmesa'), 'null', or 'auto'.
    rig: Cameras; default: the paper's rig.
    device: Memory of scenes, views and images: 'cpu' or 'cuda:0'.
    num_threads: Number of CPU threads; 0: all.
    line_floor_px: Minimum width of a line in images, in pixels.
    debug_palette: Whether halted and parked agents have other colours.
    samples: For 'gl': '4' (MSAA) or '4x4' (supersampling).
    camera_severity: Severity of randomized cameras, 0 to 2, as in evaluations (docs/explanation/cameras.md). The field
        `key` of a view, which a simulator sets, keys the random numbers.
    stream: A cudaStream_t as int; None: the legacy default stream.

Raises:
    pictura.UsageError: The name is unknown; the message lists the valid names.
    pictura.Error: The renderer cannot run on this machine.)")
      .def_static(
          "_of", [](const RendererInside& inside) { return std::make_unique<PyRenderer>(inside.renderer); },
          py::arg("inside"))
      .def("_inside", &PyRenderer::inside)
      .def_property_readonly("name", [](PyRenderer& self) { return std::string(self.renderer().name()); })
      .def_property_readonly("choice", &PyRenderer::choice, py::doc("Selected renderer, with the reason."))
      .def_property_readonly("device", [](PyRenderer& self) { return name_of(self.renderer().device()); })
      .def_property_readonly("rig", [](PyRenderer& self) { return self.renderer().config().rig; })
      .def_property(
          "stream", [](const PyRenderer& self) { return reinterpret_cast<intptr_t>(self.stream().handle); },
          [](PyRenderer& self, const py::object& stream) { self.set_stream(stream_of(stream)); },
          py::doc("The cudaStream_t on which work is enqueued, as int; 0: the legacy default stream."))
      .def(
          "upload",
          [](PyRenderer& self, int handle, const Geometry& geometry) {
            self.calls().run("upload", [&] { self.renderer().upload(handle, *geometry.geometry, self.stream()); });
          },
          py::arg("handle"), py::arg("geometry"),
          "Copies a geometry to the renderer. Scenes refer to it by `handle`, 0 to 65535. Raises pictura.Error if the "
          "geometry is invalid.")
      .def(
          "make_images",
          [](PyRenderer& self, int num_views, const std::string& type, bool planes) {
            return std::make_shared<Images>(self.renderer().config().rig, num_views, format_of(type), planes,
                                            self.renderer().device(), self.stream());
          },
          py::arg("num_views"), py::kw_only(), py::arg("dtype") = "uint8", py::arg("planes") = false,
          "Allocates images for num_views views. dtype: 'uint8' has values from 0 to 255; 'float32' and 'float16', "
          "which some renderers lack, have values from 0 to 1. planes: whether depth, class and instance are drawn "
          "too.")
      .def("render", &PyRenderer::render, py::arg("scene"), py::arg("views"), py::arg("out") = py::none(),
           py::kw_only(), py::arg("dtype") = "uint8", py::arg("planes") = false,
           R"(Draws the images of every camera for every view. Returns `out`.

views: VIEW_DTYPE [n], or Simulator.views.
out: Images, or an array [n, cameras, 3, height, width] in the renderer's memory (NumPy, torch, ...) if all cameras have
the same image size. Its type is uint8 or bfloat16, with values from 0 to 255, or float32 or float16, with values from 0
to 1. Default: new Images with `dtype` and `planes`.
On CUDA the call returns when the work is enqueued. On the CPU, ^C ends the call between two views. Raises
pictura.Error, which names an invalid array.)")
      .def("visibility", &PyRenderer::visibility, py::arg("scene"), py::arg("views"), py::arg("queries"),
           R"(Returns the visibility of agents, float32 [n].

queries: int [n, 2], pairs of (index of the view, index of the box in the scene).
A visibility is the area that the box covers in the view's images, divided by the area that it covers if it is drawn
alone. It is NaN if the box is outside the images of all cameras.)")
      .def(
          "check", [](PyRenderer& self) { self.calls().run("check", [&] { self.renderer().check(self.stream()); }); },
          "Waits for the work on the stream. Raises pictura.Error for errors that CUDA kernels have found.");
  module.def("renderer_names", renderer_names, R"(
Returns the renderers of this build.

Examples:
    >>> 'cpu' in pictura.renderer_names()
    True)");
}

}  // namespace

void bind_rendering(py::module_& module) {
  bind_dtypes(module);
  bind_rig(module);
  bind_scene(module);
  bind_images(module);
  bind_renderer(module);
}

}  // namespace pictura::python
