// Exclusive access to a folder for one process.
#include "pictura/common/support/folder_lock.h"

#include <csignal>
#include <filesystem>
#include <optional>

#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

class FolderLockTest : public testing::Test {
 protected:
  std::string refusal() const {
    return test::message_of([this] { FolderLock lock(folder_.path()); });
  }
  test::ScratchFolder folder_;
};

TEST_F(FolderLockTest, IsHeldOnceUntilItEnds) {
  std::optional<FolderLock> first(folder_.path());
  EXPECT_EQ(refusal(), fmt::format("{}: in use by process {}", folder_.path(), getpid()));
  first.reset();
  EXPECT_NO_THROW(FolderLock(folder_.path()));
}

TEST_F(FolderLockTest, TheDeathOfItsProcessReleasesIt) {
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const pid_t child = fork();
  if (child == 0) {
    const FolderLock lock(folder_.path());
    [[maybe_unused]] const ssize_t told = write(ready[1], "x", 1);
    pause();
  }
  char byte = 0;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  EXPECT_EQ(refusal(), fmt::format("{}: in use by process {}", folder_.path(), child));
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  EXPECT_EQ(read_file(folder_ / "lock"), std::to_string(child)) << "it stays, and is harmless";
  EXPECT_NO_THROW(FolderLock(folder_.path()));
  EXPECT_EQ(read_file(folder_ / "lock"), std::to_string(getpid()));
  close(ready[0]);
  close(ready[1]);
}

TEST_F(FolderLockTest, ErrorsNameAnAbsentFolder) {
  EXPECT_THAT(test::message_of([this] { FolderLock lock(folder_ / "none"); }),
              testing::HasSubstr("none/lock: cannot be opened"));
}

TEST_F(FolderLockTest, ALinkIsRefusedAndItsTargetUnchanged) {
  write_file(folder_ / "mine", "text");
  std::filesystem::create_symlink("mine", folder_ / "lock");
  EXPECT_EQ(refusal(), folder_.path() + "/lock: expected a file, got a link");
  EXPECT_EQ(read_file(folder_ / "mine"), "text");
}

}  // namespace
}  // namespace pictura
