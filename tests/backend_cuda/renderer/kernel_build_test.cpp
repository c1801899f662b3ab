// Kernels that are built at run time, tested on machines without a GPU: the code that a device would load, for every
// named architecture, and the cache of this code on disk.
#include "pictura/backend_cuda/renderer/kernel_build.h"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/common/support/file.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {

std::string cuda_unavailable();

namespace {

namespace fs = std::filesystem;
using cuda::build_kernels;
using cuda::kernel_cache_path;
using cuda::KernelCode;
using cuda::KernelTarget;
using test::EnvironmentVariable;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

constexpr KernelTarget kPaperRig{90, 4, 96, 54};

// A program small enough to be compiled often; the renderer's kernels take seconds.
constexpr cuda::KernelSource kHeader{"pictura/size.cuh", "constexpr int kSize = PICTURA_RIG_WIDTH_PX;"};
constexpr cuda::KernelProgram kSmall{
    "#include \"pictura/size.cuh\"\n"
    "extern \"C\" __global__ void pictura_small(float* out, float a, float b) {\n"
    "  *out = a * b + static_cast<float>(kSize * PICTURA_RIG_HEIGHT_PX + PICTURA_RIG_CAMERAS);\n"
    "}\n",
    {&kHeader, 1}};

std::string message_of_build(const cuda::KernelProgram& program, const KernelTarget& target) {
  return test::message_of([&] { build_kernels(program, target); });
}

class KernelArchitecture : public testing::TestWithParam<int> {};

TEST_P(KernelArchitecture, KernelsCompileToCode) {
  const KernelCode code = build_kernels(cuda::renderer_program(), {GetParam(), 4, 96, 54, GetParam() == 90});
  EXPECT_EQ(code.architecture, "sm_" + std::to_string(GetParam()));
  EXPECT_THAT(code.bytes, StartsWith("\x7f"
                                     "ELF"));
  for (const std::string kernel : cuda::kKernelNames) {
    EXPECT_THAT(code.bytes, HasSubstr(".text." + kernel + '\0'));  // whole: some names begin as others do
  }
  EXPECT_FALSE(code.cached);
}

INSTANTIATE_TEST_SUITE_P(All, KernelArchitecture, testing::Values(80, 90, 100, 120),
                         [](const auto& capability) { return "sm_" + std::to_string(capability.param); });

TEST(KernelBuild, ADeviceUnknownToNvrtcGetsPtx) {
  const KernelCode code = build_kernels(kSmall, {9990, 4, 96, 54});
  EXPECT_THAT(code.architecture, StartsWith("compute_"));
  EXPECT_THAT(code.bytes, HasSubstr(".entry pictura_small("));
  EXPECT_THAT(code.bytes, Not(HasSubstr("fma.rn")));  // the arithmetic contract
}

TEST(KernelBuild, AnOldDeviceIsRefused) {
  EXPECT_THAT(message_of_build(kSmall, {35}), HasSubstr("compute capability 35: expected"));
}

TEST(KernelBuild, ErrorsContainTheCompilersMessage) {
  EXPECT_THAT(message_of_build({"#include \"pictura/none.cuh\"\n", {}}, kPaperRig),
              AllOf(HasSubstr("sm_90"), HasSubstr("pictura_kernels.cu(1)"), HasSubstr("pictura/none.cuh")));
}

TEST(KernelBuild, TheRigIsCompiledIn) {
  const KernelCode any = build_kernels(kSmall, {90}), paper = build_kernels(kSmall, kPaperRig),
                   wide = build_kernels(kSmall, {90, 4, 192, 54});
  EXPECT_NE(any.bytes, paper.bytes);
  EXPECT_NE(wide.bytes, paper.bytes);
  EXPECT_EQ(build_kernels(kSmall, kPaperRig).bytes, paper.bytes);
}

TEST(KernelBuild, AMissingCompilerIsNamed) {
  const EnvironmentVariable library("PICTURA_NVRTC", "libNotThere.so.99");
  EXPECT_THAT(cuda::nvrtc_unavailable(), HasSubstr("cannot open libNotThere.so.99"));
  EXPECT_THAT(message_of_build(kSmall, kPaperRig), HasSubstr("cannot open libNotThere.so.99"));
  const EnvironmentVariable off("PICTURA_NVRTC", "off");
  EXPECT_THAT(cuda::nvrtc_unavailable(), HasSubstr("PICTURA_NVRTC=off"));
}

class KernelCache : public testing::Test {
 protected:
  void expect_built_anew(const std::string& damage) {
    const std::string path = kernel_cache_path(kSmall, kPaperRig), sound = read_file(path);
    write_file(path, damage);
    const KernelCode again = build_kernels(kSmall, kPaperRig);
    EXPECT_FALSE(again.cached);
    EXPECT_EQ(read_file(path), sound);
  }
  const test::ScratchFolder folder_;
  EnvironmentVariable cache_home_{"XDG_CACHE_HOME", folder_ / "cache"}, cache_{"PICTURA_CACHE", std::nullopt};
};

TEST_F(KernelCache, KernelsAreCompiledOnce) {
  const KernelCode first = build_kernels(kSmall, kPaperRig), second = build_kernels(kSmall, kPaperRig);
  EXPECT_FALSE(first.cached);
  EXPECT_TRUE(second.cached);
  EXPECT_EQ(first.bytes, second.bytes);
  EXPECT_EQ(second.architecture, "sm_90");
  // The path depends on the target and the sources.
  EXPECT_NE(kernel_cache_path(kSmall, {80, 4, 96, 54}), kernel_cache_path(kSmall, kPaperRig));
  EXPECT_NE(kernel_cache_path(kSmall, {90, 4, 97, 54}), kernel_cache_path(kSmall, kPaperRig));
  EXPECT_NE(kernel_cache_path(kSmall, {90, 5, 96, 54}), kernel_cache_path(kSmall, kPaperRig));
  cuda::KernelSource header = kHeader;
  header.text = "constexpr int kSize = 1;";
  EXPECT_NE(kernel_cache_path({kSmall.text, {&header, 1}}, kPaperRig), kernel_cache_path(kSmall, kPaperRig));
  EXPECT_NE(kernel_cache_path({"", kSmall.headers}, kPaperRig), kernel_cache_path(kSmall, kPaperRig));
  const fs::path kept = kernel_cache_path(kSmall, kPaperRig);
  EXPECT_EQ(std::distance(fs::directory_iterator(kept.parent_path()), fs::directory_iterator()), 1);
}

TEST_F(KernelCache, DamagedFilesAreReplaced) {
  build_kernels(kSmall, kPaperRig);
  const std::string sound = read_file(kernel_cache_path(kSmall, kPaperRig));
  std::string flipped = sound;
  flipped[flipped.size() / 2] ^= 1;
  for (const std::string& damage : {flipped, sound.substr(0, sound.size() - 1), sound.substr(0, 20), sound + "x",
                                    std::string(), std::string("\n"), sound.substr(sound.find('\n') + 1)}) {
    expect_built_anew(damage);
  }
}

TEST_F(KernelCache, AnotherTargetsFileIsRefused) {
  build_kernels(kSmall, kPaperRig);
  build_kernels(kSmall, {90});
  expect_built_anew(read_file(kernel_cache_path(kSmall, {90})));
}

TEST_F(KernelCache, CanBeAbsentOrDisabled) {
  write_file(folder_ / "cache", "a file where the folder would be");
  EXPECT_FALSE(build_kernels(kSmall, kPaperRig).cached);
  const EnvironmentVariable off("PICTURA_CACHE", "off");
  EXPECT_EQ(kernel_cache_path(kSmall, kPaperRig), "");
  EXPECT_FALSE(build_kernels(kSmall, kPaperRig).cached);
}

// Errors and notes on a machine without a GPU.
TEST(NoDevice, CudaIsRefusedAndAutoReportsWhyItUsesTheCpu) {
  const std::string why = cuda_unavailable();
  if (why.empty()) GTEST_SKIP() << "this machine has a CUDA device";
  EXPECT_EQ(test::message_of([] { make_renderer("cuda", {}); }), "renderer cuda: " + why);
  std::string choice;
  EXPECT_EQ(make_renderer("auto", {.device = {MemorySpace::cuda, 0}}, &choice)->name(), "cpu");
  EXPECT_EQ(choice, "cpu: " + why);
}

}  // namespace
}  // namespace pictura
