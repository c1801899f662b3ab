// Effects of output files on existing files, links, folders and devices, and the remains of a killed writer.
#include "pictura/common/support/output_file.h"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class OutputFileTest : public testing::TestWithParam<Staging> {
 protected:
  void put(const std::string& path, const std::string& bytes) const {
    OutputFile out(path, GetParam());
    out.write(bytes);
    out.commit();
  }

  test::ScratchFolder folder_;
};

INSTANTIATE_TEST_SUITE_P(, OutputFileTest, testing::Values(Staging::unnamed, Staging::named),
                         [](const auto& each) { return each.param == Staging::unnamed ? "Unnamed" : "Named"; });

TEST_P(OutputFileTest, ReplacesTheOldFileOnlyOnCommit) {
  const std::string path = folder_ / "a.txt";
  put(path, "old");
  {
    OutputFile out(path, GetParam());
    out.write("half");
    EXPECT_EQ(read_file(path), "old");
  }
  EXPECT_EQ(read_file(path), "old");
  put(path, "new");
  EXPECT_EQ(read_file(path), "new");
  EXPECT_EQ(folder_.num_entries(), 1u);
}

TEST_P(OutputFileTest, FollowsLinksToExistingAndAbsentFiles) {
  fs::create_directory(folder_ / "deeper");
  put(folder_ / "deeper/target", "old");
  fs::create_symlink("deeper/target", folder_ / "link");
  fs::create_symlink("link", folder_ / "link to link");
  fs::create_symlink("deeper/missing", folder_ / "dangling");
  fs::create_symlink("circle", folder_ / "circle");
  put(folder_ / "link to link", "new");
  put(folder_ / "dangling", "made");
  EXPECT_EQ(read_file(folder_ / "deeper/target"), "new");
  EXPECT_EQ(read_file(folder_ / "deeper/missing"), "made");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_TRUE(fs::is_symlink(folder_ / "dangling"));
  EXPECT_THAT(test::message_of([&] { put(folder_ / "circle", "x"); }), HasSubstr("circle: cannot be written"));
}

TEST_P(OutputFileTest, WritesToDevicesAndFifosWithoutReplacingThem) {
  EXPECT_EQ(test::message_of([&] { put("/dev/full", "x"); }), "/dev/full: cannot be written: No space left on device");
  put("/dev/null", "x");
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  const std::string path = folder_ / "fifo";
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  fs::create_symlink("fifo", folder_ / "link");
  const std::string sent(300'000, 'x');  // more than a pipe holds
  std::string got;
  std::thread reader([&] { got = read_file(path); });
  put(folder_ / "link", sent);
  reader.join();
  EXPECT_EQ(got, sent);
  EXPECT_TRUE(fs::is_fifo(path));
  EXPECT_EQ(folder_.num_entries(), 2u);
}

TEST_P(OutputFileTest, WritesToDescriptorPaths) {
  const std::string path = folder_ / "redirected";
  put(path, "0123456789");
  const Descriptor file(::open(path.c_str(), O_RDWR));
  ASSERT_EQ(::write(file.get(), "ab", 2), 2);
  fs::create_symlink(fmt::format("/dev/fd/{}", file.get()), folder_ / "link");
  put(fmt::format("/proc/self/fd/{}", file.get()), "cd");
  put(fmt::format("/dev/fd/{}", file.get()), "ef");
  put(folder_ / "link", "gh");
  EXPECT_EQ(read_file(path), "abcdefgh89");
  struct stat named{}, open{};
  ::stat(path.c_str(), &named);
  ::fstat(file.get(), &open);
  EXPECT_EQ(named.st_ino, open.st_ino) << "the file was replaced";
  const Descriptor reading(::open(path.c_str(), O_RDONLY));
  const std::string name = fmt::format("/proc/self/fd/{}", reading.get());
  EXPECT_EQ(test::message_of([&] { put(name, "x"); }), name + ": cannot be written: Bad file descriptor");
  EXPECT_EQ(folder_.num_entries(), 2u);
}

TEST_P(OutputFileTest, KeepsTheFileModeAndRefusesReadOnlyFiles) {
  const std::string path = folder_ / "a.txt";
  put(path, "old");
  for (const fs::perms mode : {fs::perms(0640), fs::perms(0777), fs::perms(0600)}) {
    fs::permissions(path, mode);
    put(path, "new");
    EXPECT_EQ(fs::status(path).permissions(), mode);
  }
  fs::permissions(path, fs::perms(0444));
  EXPECT_EQ(test::message_of([&] { put(path, "x"); }), path + ": cannot be written: it is read-only");
  EXPECT_EQ(read_file(path), "new");
}

TEST_P(OutputFileTest, ErrorsNameTheVariableOfTheTemporaryFolder) {
  const test::EnvironmentVariable folder("TMPDIR", folder_ / "missing");
  EXPECT_EQ(test::message_of([&] { put("/dev/null", "x"); }),
            "/dev/null: cannot be written: expected $TMPDIR to name a folder for temporary files: No such file or "
            "directory");
  put(folder_ / "a.txt", "x");
}

TEST_P(OutputFileTest, RemovesNoUserFile) {
  const std::vector<std::string> names{".a.txt.backup.tmp", ".a.txt.1.0.tmp", ".pictura-notes.tmp",
                                       ".pictura-0123456789abcdeg.tmp"};
  for (const std::string& name : names) std::ofstream(folder_ / name) << "mine";
  fs::create_symlink(names[0], folder_ / ".pictura-0123456789abcdef.tmp");
  put(folder_ / "a.txt", "new");
  EXPECT_EQ(folder_.num_entries(), names.size() + 2);
}

TEST_P(OutputFileTest, RefusesFoldersAndNamesUnwritablePaths) {
  EXPECT_EQ(test::message_of([&] { put(folder_.path(), "x"); }),
            folder_.path() + ": cannot be written: expected a file, got a folder");
  EXPECT_EQ(test::message_of([&] { put("/proc/nowhere/a", "x"); }),
            "/proc/nowhere/a: cannot be written: No such file or directory");
  EXPECT_THAT(test::message_of([&] { put("", "x"); }), HasSubstr("empty"));
}

TEST_P(OutputFileTest, AFullDiskKeepsTheOldFile) {
  const std::string path = folder_ / "a.txt";
  put(path, "old");
  const pid_t child = ::fork();
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{4096, 4096};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    const std::string message = test::message_of([&] { put(path, std::string(10'000, 'x')); });
    ::_exit(message == path + ": cannot be written: File too large" ? 0 : 1);
  }
  int status = -1;
  ::waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(read_file(path), "old");
  EXPECT_EQ(folder_.num_entries(), 1u);
}

TEST_P(OutputFileTest, RemovesFilesOfKilledWritersButNotOfActiveWriters) {
  const std::string path = folder_ / "a.txt";
  const pid_t child = ::fork();
  if (child == 0) {
    OutputFile out(path, GetParam());
    out.write("half");
    ::raise(SIGKILL);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status));
  if (GetParam() == Staging::unnamed) {
    EXPECT_EQ(folder_.num_entries(), 0u);
  }
  OutputFile other(path, GetParam());
  other.write("other");
  put(path, "first");
  other.commit();
  EXPECT_EQ(read_file(path), "other");
  EXPECT_EQ(folder_.num_entries(), 1u);
}

}  // namespace
}  // namespace pictura
