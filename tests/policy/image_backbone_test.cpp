// User programs that replace the convolutions of a policy: their inputs, outputs and gradients.
#include "pictura/policy/image_backbone.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <torch/csrc/jit/api/module.h>

#include "pictura/common/support/file.h"
#include "pictura/policy/policy.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

using test::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;

class Programs : public ::testing::Test {
 protected:
  // Means over patches of 2x2, times a weight of each color.
  std::string write(const std::string& description) {
    torch::jit::Module program("Means");
    program.register_parameter("gain", at::tensor({1.0f, 2.0f, 4.0f}).view({1, 3, 1, 1}), /*is_buffer=*/false);
    program.define("def forward(self, x):\n  return torch.avg_pool2d(x, [2, 2]) * self.gain\n");
    torch::jit::ExtraFilesMap files;
    if (!description.empty()) files["pictura_backbone.json"] = description;
    program.save(folder_ / "means.pt", files);
    return folder_ / "means.pt";
  }
  static std::string description(int patch_px, int channels, const char* size_px) {
    return fmt::format(R"({{"format": "pictura backbone 1", "patch_px": {}, "channels": {}, "size_px": {}}})", patch_px,
                       channels, size_px);
  }

  const at::Tensor images_ = at::arange(2 * 4 * 3 * 3 * 5, at::kInt).remainder(251).to(at::kByte).view({2, 4, 3, 3, 5});
  test::ScratchFolder folder_;
};

TEST_F(Programs, GetColorsFromZeroToOnePerCameraPaddedWithBlack) {
  const ImageBackbone means(write(description(2, 3, "null")), at::TensorOptions(at::kFloat), /*frozen=*/true);
  EXPECT_EQ(means.channels(), 3);
  EXPECT_TRUE(means.parameters().empty());
  const at::Tensor out = means.forward(images_);
  ASSERT_EQ(out.sizes(), (std::vector<int64_t>{8, 3, 2, 3}));
  EXPECT_FALSE(out.requires_grad());
  EXPECT_TRUE(out.is_contiguous(at::MemoryFormat::ChannelsLast));
  const auto pixel = [&](int64_t view, int64_t camera, int64_t color, int64_t y, int64_t x) {
    return y < 3 && x < 5 ? images_[view][camera][color][y][x].item<uint8_t>() / 255.0 : 0.0;
  };
  for (const auto& [view, camera, color, row, column] : {std::array{1, 2, 1, 0, 1}, std::array{0, 3, 2, 1, 2}}) {
    const double mean =
        (pixel(view, camera, color, 2 * row, 2 * column) + pixel(view, camera, color, 2 * row, 2 * column + 1) +
         pixel(view, camera, color, 2 * row + 1, 2 * column) +
         pixel(view, camera, color, 2 * row + 1, 2 * column + 1)) /
        4;
    EXPECT_NEAR(out[camera * 2 + view][color][row][column].item<double>(), mean * (1 << color), 1e-6);
  }
}

TEST_F(Programs, GetGradientsWhereTheyAreTrained) {
  const ImageBackbone means(write(description(2, 3, "null")), at::TensorOptions(at::kDouble), /*frozen=*/false);
  ASSERT_EQ(means.parameters().size(), 1u);
  EXPECT_EQ(means.parameters()[0].name, "image_backbone.gain");
  const at::Tensor gain = means.parameters()[0].value;
  EXPECT_EQ(gain.scalar_type(), at::kDouble);
  means.forward(images_).sum().backward();
  ASSERT_TRUE(gain.grad().defined());
  EXPECT_GT(gain.grad().min().item<double>(), 0);
  // The program computes with the weights that an optimizer writes.
  const at::Tensor before = means.forward(images_).detach();
  {
    const at::NoGradGuard no_grad;
    gain.mul_(2);
  }
  EXPECT_TRUE(means.forward(images_).detach().allclose(2 * before));
}

TEST_F(Programs, ErrorsNameInvalidPrograms) {
  const at::TensorOptions options(at::kFloat);
  const auto message = [&](const std::string& path) { return message_of([&] { ImageBackbone(path, options, true); }); };
  EXPECT_THAT(message(write("")), AllOf(HasSubstr("means.pt"), HasSubstr("scripts/export_backbone")));
  EXPECT_THAT(message(write("{}")), AllOf(HasSubstr("means.pt"), HasSubstr("pictura backbone 1")));
  EXPECT_THAT(message(write(description(0, 3, "null"))), HasSubstr("got 0 and 3"));
  write_file(folder_ / "text.pt", "text");
  EXPECT_THAT(message(folder_ / "text.pt"), AllOf(HasSubstr("text.pt"), HasSubstr("expected a TorchScript program")));
  const ImageBackbone wrong(write(description(2, 5, "null")), options, true);
  EXPECT_THAT(message_of([&] { wrong.forward(images_); }),
              AllOf(HasSubstr("expected a feature map of 8 x 5 x 2 x 3"), HasSubstr("got 8 x 3 x 2 x 3")));
  const ImageBackbone of_one_size(write(description(2, 3, "[6, 4]")), options, true);
  EXPECT_EQ(message_of([&] { of_one_size.check_images(paper_rig(5, 3)); }), test::kNoError);
  EXPECT_THAT(message_of([&] { of_one_size.check_images(paper_rig(8, 4)); }),
              AllOf(HasSubstr("means.pt"), HasSubstr("6x4"), HasSubstr("'front' has 8x4")));
}

TEST_F(Programs, HaveTheHashOfTheirFiles) {
  const at::TensorOptions options(at::kFloat);
  const std::string path = write(description(2, 3, "null"));
  const std::string hash = ImageBackbone(path, options, true).hash();
  EXPECT_EQ(hash.size(), 16u);
  EXPECT_EQ(ImageBackbone(path, options, false).hash(), hash);
  EXPECT_NE(ImageBackbone(write(description(2, 3, "[6, 4]")), options, true).hash(), hash);
}

}  // namespace
}  // namespace pictura
