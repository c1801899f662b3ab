#include "pictura/bench/history.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <memory>
#include <random>

#include "pictura/backends/make_learner.h"
#include "pictura/backends/make_renderer.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/bench/image_error.h"
#include "pictura/bench/repeats.h"
#include "pictura/bench/step_rate.h"
#include "pictura/common/error.h"
#include "pictura/common/support/interrupt.h"
#ifdef PICTURA_HAS_CUDA
#include "pictura/common/cuda/device_buffer.h"
#endif

namespace pictura {

namespace {

// Number of sets of random choices. Calls use the sets cyclically, so that no call finds its data in caches.
constexpr std::size_t kChoices = 8;

// An array in the memory of a device or of the host.
template <typename T>
class Elements {
 public:
  Elements(Device device, std::size_t size) : device_(device) {
    if (device.is_host()) {
      host_.resize(size);
      return;
    }
#ifdef PICTURA_HAS_CUDA
    buffer_ = DeviceBuffer<T>(size);
#else
    fail("bench history: this build has no CUDA");
#endif
  }
  Elements(Device device, const std::vector<T>& values) : Elements(device, values.size()) {
    if (device.is_host()) host_ = values;
#ifdef PICTURA_HAS_CUDA
    if (!device.is_host()) buffer_.copy_from_host(values.data());
#endif
  }

  Span<T> writable() {
#ifdef PICTURA_HAS_CUDA
    if (!device_.is_host()) return {buffer_.data(), buffer_.size()};
#endif
    return {host_.data(), host_.size()};
  }
  Span<const T> span() {
    const Span<T> all = writable();
    return {all.data(), all.size()};
  }
  void fill(int byte) {
#ifdef PICTURA_HAS_CUDA
    if (!device_.is_host()) return buffer_.fill(byte);
#endif
    std::memset(host_.data(), byte, host_.size() * sizeof(T));
  }

 private:
  Device device_;
  std::vector<T> host_;
#ifdef PICTURA_HAS_CUDA
  DeviceBuffer<T> buffer_;
#endif
};

// Copies elements to the host after the device has finished its work.
template <typename T>
std::vector<T> to_host(Span<const T> from, Device device) {
  std::vector<T> result(from.size());
  if (device.is_host()) {
    std::copy(from.begin(), from.end(), result.begin());
    return result;
  }
#ifdef PICTURA_HAS_CUDA
  PICTURA_CUDA(cudaMemcpy(result.data(), from.data(), from.size() * sizeof(T), cudaMemcpyDeviceToHost));
#endif
  return result;
}

// Images of a number of views, in u8.
class Images {
 public:
  Images(const Rig& rig, int num_views, Device device)
      : layout_(image_layout(rig, num_views, PixelFormat::u8)), bytes_(device, layout_.bytes()) {
    for (const CameraLayout& camera : layout_.cameras) {
      cameras_.push_back(
          {camera.size.width_px, camera.size.height_px, bytes_.writable().data() + camera.offset, camera.view_stride});
    }
    batch_ = {device, PixelFormat::u8, num_views, cameras_};
  }
  Images(const Images&) = delete;
  Images& operator=(const Images&) = delete;

  const ImageBatch& batch() const { return batch_; }
  void fill_unwritten() { bytes_.fill(kUnwrittenByte); }
  std::vector<uint8_t> to_host() { return pictura::to_host(bytes_.span(), batch_.device); }
  /// Returns the bytes of one view, camera by camera, from the bytes of all views.
  std::vector<uint8_t> view_of(const std::vector<uint8_t>& all, int64_t view) const {
    std::vector<uint8_t> result;
    for (const CameraLayout& camera : layout_.cameras) {
      const auto first = all.begin() + camera.offset + view * camera.view_stride;
      result.insert(result.end(), first, first + 3 * camera.size.pixels());
    }
    return result;
  }

 private:
  ImageLayout layout_;
  Elements<uint8_t> bytes_;
  std::vector<CameraImages> cameras_;
  ImageBatch batch_;
};

// The images of a view, drawn during the view's step.
struct CheckedView {
  int64_t row = 0;
  std::vector<uint8_t> pixels;
};

class HistoryBench {
 public:
  explicit HistoryBench(const HistoryCase& history_case)
      : case_(history_case),
        device_(history_case.backend == "cuda" ? Device{MemorySpace::cuda, 0} : Device{}),
        random_(history_case.simulator.seed) {
    SimulatorConfig simulator = case_.simulator;
    simulator.device = device_;
    simulator_ = make_simulator(case_.backend, simulator, case_.maps, case_.worlds);
    renderer_ = make_renderer(
        case_.backend, {.rig = case_.rig, .device = device_, .num_threads = simulator.num_threads}, &result_.choice);
    upload_maps(*simulator_, renderer_.get());
  }

  HistoryMeasurement measure() {
    record();
    choose();
    compare();
    time();
    compare();
    return result_;
  }

 private:
  std::size_t num_slots() const { return static_cast<std::size_t>(simulator_->num_slots()); }

  // Fills the history, and keeps the images of some views.
  void record() {
    StepBench steps(simulator_.get(), case_.simulator.seed);
    if (case_.warm_up_steps > 0) steps.run(case_.warm_up_steps);
    const SceneBatch& scene = simulator_->scene();
    const SceneHistorySize size{case_.num_steps, scene.geometry.size(), scene.agents.size(), scene.light_states.size(),
                                simulator_->views().size()};
    history_ = make_scene_history(device_, size);
    result_.history_bytes = static_cast<double>(bytes_of(size));
    Images image(case_.rig, 1, device_);
    int kept = 0;
    for (int step = 0; step < case_.num_steps; ++step) {
      throw_if_interrupted();
      steps.run(1);
      history_->put(step, simulator_->scene(), simulator_->views());
      views_ = to_host(simulator_->views(), device_);
      const std::size_t before = present_rows_.size();
      for (std::size_t slot = 0; slot < views_.size(); ++slot) {
        if (views_[slot].ego_agent < 0) continue;
        present_rows_.push_back(static_cast<int64_t>(static_cast<std::size_t>(step) * num_slots() + slot));
      }
      first_of_last_step_ = before;
      PICTURA_CHECK(present_rows_.size() > before, "bench history: no agent found a place in step {}", step);
      // Checked images are spread over all steps.
      for (; int64_t{kept} * case_.num_steps < int64_t{step + 1} * case_.checked_images; ++kept) {
        const int64_t row = draw(before);
        Elements<View> view(device_, std::vector<View>{views_[static_cast<std::size_t>(row) % num_slots()]});
        image.fill_unwritten();
        renderer_->render(simulator_->scene(), view.span(), image.batch());
        renderer_->check();
        seen_.push_back({row, image.view_of(image.to_host(), 0)});
      }
    }
  }

  // Returns a random row of a present agent, from present_rows_[first] on.
  int64_t draw(std::size_t first) { return present_rows_[first + random_() % (present_rows_.size() - first)]; }

  void choose() {
    const auto size = static_cast<std::size_t>(case_.num_views);
    for (std::size_t i = 0; i < kChoices; ++i) {
      std::vector<int64_t> rows(size);
      std::generate(rows.begin(), rows.end(), [this] { return draw(0); });
      history_choices_.emplace_back(device_, rows);
      std::vector<View> views(size);
      std::generate(views.begin(), views.end(),
                    [this] { return views_[static_cast<std::size_t>(draw(first_of_last_step_)) % num_slots()]; });
      present_choices_.emplace_back(device_, views);
    }
  }

  // Draws the kept views from the history, in reverse order, and compares the images with the kept images.
  void compare() {
    if (seen_.empty()) return;
    std::vector<int64_t> rows;
    for (auto seen = seen_.rbegin(); seen != seen_.rend(); ++seen) rows.push_back(seen->row);
    Elements<int64_t> rows_there(device_, rows);
    Elements<View> views(device_, rows.size());
    Images images(case_.rig, static_cast<int>(rows.size()), device_);
    images.fill_unwritten();
    draw_from_history(rows_there.span(), views.writable(), images.batch());
    renderer_->check();
    const std::vector<uint8_t> all = images.to_host();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const std::vector<uint8_t>& expected = seen_[seen_.size() - 1 - i].pixels;
      const std::vector<uint8_t> actual = images.view_of(all, static_cast<int64_t>(i));
      int64_t differing = 0;
      for (std::size_t k = 0; k < expected.size(); ++k) differing += actual[k] != expected[k];
      PICTURA_CHECK(
          differing == 0,
          "bench history: slot {} of step {}: expected the images drawn at the time, got {} differing values of {}",
          rows[i] % simulator_->num_slots(), rows[i] / simulator_->num_slots(), differing, expected.size());
    }
  }

  void draw_from_history(Span<const int64_t> rows, Span<View> views, const ImageBatch& images) {
    history_->gather(rows, views);
    renderer_->render(history_->scene(), Span<const View>(views.data(), views.size()), images);
  }

  // Returns the mean time of `calls` calls in milliseconds. The calls use the sets of random choices cyclically. Waits
  // for the device before it reads the host's clock.
  template <typename Call>
  double time_of(int calls, const Call& call) {
    renderer_->check();
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < calls; ++i) call(next_++ % kChoices);
    renderer_->check();
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count() / calls;
  }

  void time() {
    Images images(case_.rig, case_.num_views, device_);
    Elements<View> views(device_, static_cast<std::size_t>(case_.num_views));
    const auto present = [&](std::size_t i) {
      renderer_->render(simulator_->scene(), present_choices_[i].span(), images.batch());
    };
    const auto past = [&](std::size_t i) {
      draw_from_history(history_choices_[i].span(), views.writable(), images.batch());
    };
    // Warms up.
    time_of(1, past);
    time_of(1, present);
    const int present_calls = calls_in_repeat(case_.repeat_s, time_of(1, present));
    const int past_calls = calls_in_repeat(case_.repeat_s, time_of(1, past));
    for (int repeat = 0; repeat < case_.repeats; ++repeat) {
      throw_if_interrupted();
      result_.present_ms.push_back(time_of(present_calls, present));
      result_.history_ms.push_back(time_of(past_calls, past));
    }
  }

  const HistoryCase& case_;
  const Device device_;
  std::mt19937_64 random_;
  HistoryMeasurement result_;
  std::unique_ptr<Simulator> simulator_;
  std::unique_ptr<Renderer> renderer_;
  std::unique_ptr<SceneHistory> history_;
  std::vector<int64_t> present_rows_;  // rows of present agents at every step
  std::size_t first_of_last_step_ = 0;
  std::vector<View> views_;  // views of the last step, on the host
  std::vector<CheckedView> seen_;
  std::vector<Elements<int64_t>> history_choices_;
  std::vector<Elements<View>> present_choices_;
  std::size_t next_ = 0;
};

}  // namespace

HistoryMeasurement measure_history(const HistoryCase& history_case) { return HistoryBench(history_case).measure(); }

}  // namespace pictura
