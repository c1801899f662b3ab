// progress.csv: what it keeps of an older file.
#include "pictura/training/run_log.h"

#include <gmock/gmock.h>

#include "pictura/common/support/file.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class ProgressCsvFile : public ::testing::Test {
 protected:
  // The file after a run that has done `updates_done` updates has found `before` in it and written update 9.
  std::string after(const std::string& before, int64_t updates_done) {
    write_file(path_, before);
    ProgressCsv csv(path_, columns_, updates_done, [this](const std::string& text) { notices_.push_back(text); });
    csv.write(9, {{"a", 0.5}, {"b", 7}});
    return read_file(path_);
  }

  test::ScratchFolder folder_;
  const std::string path_ = folder_ / "progress.csv";
  const Scalars columns_{{"a", 0}, {"b", 0}};
  std::vector<std::string> notices_;
};

TEST_F(ProgressCsvFile, KeepsWholeRowsOfUpdatesThatAreDone) {
  const std::string rows = "update,a,b\n1,2,3\n2,nan,-5e-3\n";
  const std::string whole = rows + "9,0.5,7\n";
  EXPECT_EQ(after("", 2), "update,a,b\n9,0.5,7\n");
  EXPECT_EQ(after(rows, 2), whole);
  EXPECT_EQ(after(rows + "3,1,1\n4,1,1\n", 2), whole) << "beyond the checkpoint";
  EXPECT_EQ(after(rows + "2,4", 2), whole) << "torn";
  EXPECT_EQ(after(rows + "2,4,5", 2), whole) << "torn, though of all columns: who knows of how many digits";
  EXPECT_EQ(after("update,a,b\n1,2,3\n2,42,nan,-5e-3\n2,nan,-5e-3\n", 2), whole) << "torn, and appended to since";
  EXPECT_EQ(after("update,a,b\n1,2,3\n2,4\n2,,4\n2,x,4\n2,nan,-5e-3\n", 2), whole);
  EXPECT_EQ(after(rows + std::string(300, '\0'), 2), whole) << "never written";
  EXPECT_EQ(after("update,a", 2), "update,a,b\n9,0.5,7\n");
  EXPECT_TRUE(notices_.empty());
  EXPECT_EQ(folder_.num_entries(), 1u);
}

TEST_F(ProgressCsvFile, OtherColumnsGoOnInANewFile) {
  const std::string old = "update,a\n1,2\n", older = "update,z,b\n1,2,3\n";
  EXPECT_EQ(after(old, 1), "update,a,b\n9,0.5,7\n");
  EXPECT_EQ(read_file(path_ + ".1"), old);
  EXPECT_THAT(notices_, ::testing::ElementsAre(AllOf(HasSubstr(path_ + ":"), HasSubstr(path_ + ".1"))));
  EXPECT_EQ(after(older, 1), "update,a,b\n9,0.5,7\n");
  EXPECT_EQ(read_file(path_ + ".1"), old);
  EXPECT_EQ(read_file(path_ + ".2"), older);
}

}  // namespace
}  // namespace pictura
