// Headers of rules, scene and raster compile without a standard library, for every architecture that we name, on
// machines that have no GPU.
#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nvrtc.h>

namespace pictura {
namespace {

// Compiler messages, or empty where the source compiles to code for the architecture.
std::string compile(const std::string& source, const std::string& architecture) {
  nvrtcProgram program = nullptr;
  if (nvrtcCreateProgram(&program, source.c_str(), "test.cu", 0, nullptr, nullptr) != NVRTC_SUCCESS)
    return "no program";
  const std::string arch = "--gpu-architecture=" + architecture;
  const char* options[] = {arch.c_str(), "--std=c++20", "--fmad=false", "-I" PICTURA_TEST_INCLUDE_DIR};
  const nvrtcResult result = nvrtcCompileProgram(program, 4, options);
  std::size_t size = 0;
  nvrtcGetProgramLogSize(program, &size);
  std::string log(size, '\0');
  nvrtcGetProgramLog(program, log.data());
  std::size_t code_bytes = 0;
  nvrtcGetCUBINSize(program, &code_bytes);
  nvrtcDestroyProgram(&program);
  if (result != NVRTC_SUCCESS) return log;
  return code_bytes > 0 ? "" : "no code";
}

// Names of the headers that both devices read, as they are included.
std::vector<std::string> shared_headers() {
  std::vector<std::string> headers;
  for (const char* name : {"color", "grid_view", "hd", "math", "rng", "scene_types", "span", "stream"}) {
    headers.push_back(std::string("pictura/common/") + name + ".h");
  }
  const std::filesystem::path root = PICTURA_TEST_INCLUDE_DIR "/pictura";
  for (const auto& file : std::filesystem::directory_iterator(root / "common")) {
    const std::string name = file.path().filename().string();
    // raster_check.h is for hosts: it speaks of errors and vectors.
    if (name.starts_with("raster_") && name.ends_with(".h") && name != "raster_check.h") {
      headers.push_back("pictura/common/" + name);
    }
  }
  if (std::filesystem::is_directory(root / "simulator" / "rules")) {
    for (const auto& file : std::filesystem::directory_iterator(root / "simulator" / "rules")) {
      const std::string name = file.path().filename().string();
      if (name.ends_with(".h")) headers.push_back("pictura/simulator/rules/" + name);
    }
  }
  std::sort(headers.begin(), headers.end());
  return headers;
}

class Nvrtc : public testing::TestWithParam<std::string> {};

TEST_P(Nvrtc, CompilesTheHeaderAlone) {
  EXPECT_EQ(compile("#include \"" + GetParam() + "\"\n__global__ void kernel() {}\n", "sm_90"), "");
}

INSTANTIATE_TEST_SUITE_P(Headers, Nvrtc, testing::ValuesIn(shared_headers()), [](const auto& header) {
  std::string name = header.param.substr(header.param.rfind('/') + 1);
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
});

// A kernel that draws one box and one strip at one pixel: every rule is compiled to code.
const char* const kDrawing = R"(
#include "pictura/common/raster_item.h"
using namespace pictura;
struct Pool {
  PolygonEdge edges[64];
  int used = 0;
  __device__ int take(int count) { used += count; return used - count; }
  __device__ PolygonEdge* at(int index) { return edges + index; }
};
struct List {
  static constexpr int kEnd = -1;
  Fragment fragments[8];
  int count = 0;
  __device__ int begin() const { return count - 1; }
  __device__ int next(int place) const { return place - 1; }
  __device__ const Fragment& at(int place) const { return fragments[place]; }
  __device__ void remove(int place, int) { fragments[place] = fragments[--count]; }
};
__global__ void kernel(const AgentBox* box, const Strip* strip, const PinholeCamera* camera, const View* view, float* out) {
  const PinholeCamera placed = place_camera(*camera, *view);
  const ImageSetting setting{placed, make_frustum(placed), 0.35f, false};
  Pool pool;
  ScreenFace faces[8];
  List list;
  FaceOwner owner = agent_owner(*box, 0);
  auto add = [&](const Vec3* corners, int count, const FacePlane& plane, Rgb color) {
    ScreenFace& face = faces[list.count];
    if (!make_face(setting, owner, corners, count, plane, color, pool, &face)) return;
    const PixelCoverage coverage = pixel_coverage(pool.at(face.edge_begin), face.edge_count, 3, 4);
    list.fragments[list.count] = make_fragment(face, list.count, coverage, 3, 4);
    ++list.count;
  };
  agent_faces(*box, placed, false, add);
  owner = strip_owner(*strip, 0);
  strip_faces(*strip, placed, 0.35f, add);
  auto stands = [&](unsigned, unsigned) { return stands_on(extent_of(*box), extent_of(*strip)); };
  *out = lay_fragments(list, faces, 3, 4, stands, [](const Fragment&, float) {}).color.r;
}
)";

TEST(NvrtcArchitectures, CompileTheRasterRulesToCode) {
  for (const char* architecture : {"sm_80", "sm_90", "sm_100", "sm_120"}) {
    EXPECT_EQ(compile(kDrawing, architecture), "") << architecture;
  }
}

TEST(NvrtcArchitectures, AHeaderOfTheStandardLibraryIsAFault) {
  EXPECT_NE(compile("#include <vector>\n__global__ void kernel() {}\n", "sm_90"), "");
}

}  // namespace
}  // namespace pictura
