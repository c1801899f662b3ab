// Effects on existing files when a command fills a folder again.
#include "pictura/common/support/filled_folder.h"

#include <algorithm>
#include <filesystem>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/support/file.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

namespace fs = std::filesystem;
using Names = std::vector<std::string>;

class FilledFolderTest : public testing::Test {
 protected:
  void fill(const Names& names, bool is_finished = true) const {
    FilledFolder filled(folder_.path(), "pictures");
    for (const std::string& name : names) write_file(filled.file(name), "ours");
    if (is_finished) filled.remove_others();
  }
  Names names() const {
    Names all;
    for (const auto& entry : fs::directory_iterator(folder_.path())) all.push_back(entry.path().filename().string());
    std::erase(all, ".pictura-pictures");
    std::sort(all.begin(), all.end());
    return all;
  }
  test::ScratchFolder folder_;
};

TEST_F(FilledFolderTest, RemovesOnlyFilesOfEarlierCalls) {
  write_file(folder_ / "mine.png", "mine");
  fill({"a.png", "b.png", "c.png"});
  fill({"b.png", "d.png"});
  EXPECT_EQ(names(), (Names{"b.png", "d.png", "mine.png"}));
  fill({"e.png"}, /*is_finished=*/false);
  EXPECT_EQ(names(), (Names{"b.png", "d.png", "e.png", "mine.png"}));
  fill({"b.png"});
  EXPECT_EQ(names(), (Names{"b.png", "mine.png"}));
  FilledFolder(folder_.path(), "pages").remove_others();
  EXPECT_EQ(read_file(folder_ / "b.png"), "ours") << "another kind of command";
}

TEST_F(FilledFolderTest, WritesAndRemovesNothingOutsideTheFolder) {
  const test::ScratchFolder elsewhere;
  write_file(elsewhere / "mine", "mine");
  fs::create_symlink(elsewhere / "mine", folder_ / "link.png");
  EXPECT_EQ(test::message_of([&] { fill({"link.png"}); }),
            folder_ / "link.png: expected a file or nothing, got a link");
  const std::string lists =
      (elsewhere / "mine") + '\0' + "../" + fs::path(elsewhere.path()).filename().string() + "/mine" + '\0';
  write_file(folder_ / ".pictura-pictures", lists);
  fill({});
  EXPECT_EQ(read_file(elsewhere / "mine"), "mine");
  fs::remove(folder_ / ".pictura-pictures");
  fs::create_symlink(elsewhere / "mine", folder_ / ".pictura-pictures");
  EXPECT_THAT(test::message_of([&] { fill({}); }), testing::HasSubstr(".pictura-pictures: cannot be opened"));
  EXPECT_EQ(read_file(elsewhere / "mine"), "mine");
}

}  // namespace
}  // namespace pictura
