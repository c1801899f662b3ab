// Reading of whole files, PNG files, and hashes. output_file_test.cpp tests writing.
#include "pictura/common/support/file.h"

#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "pictura/common/error.h"
#include "pictura/common/image.h"
#include "pictura/common/support/hash.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

class FileTest : public testing::Test {
 protected:
  test::ScratchFolder folder_;
};

TEST_F(FileTest, ErrorsNameThePath) {
  EXPECT_THROW(read_file(folder_ / "missing"), Error);
  EXPECT_THROW(read_file(folder_.path()), Error);
  EXPECT_THROW(write_file("/proc/nowhere/a", "x"), Error);
  EXPECT_THROW(make_output_folder("/proc/nowhere"), Error);
  write_file(folder_ / "file", "x");
  EXPECT_THROW(make_output_folder(folder_ / "file"), Error);
  EXPECT_THROW(read_file("/dev/zero", 1 << 20), Error) << "endless files stop at the limit";
  try {
    write_file("/proc/nowhere/a", "x");
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::StartsWith("/proc/nowhere/a: cannot be written"));
  }
}

TEST_F(FileTest, AnUnreachableFolderIsAnErrorExceptForACache) {
  const std::string unreachable = folder_ / (std::string(300, 'x') + "/deeper");  // file systems end at 255
  EXPECT_EQ(test::message_of([&] { make_output_folder(unreachable); }),
            unreachable + ": cannot be created: File name too long");
  EXPECT_NO_THROW(write_to_cache(unreachable + "/a.map", "x"));
  EXPECT_EQ(folder_.num_entries(), 0u);
}

TEST_F(FileTest, AFileThatChangesWhileItIsReadIsRejected) {
  const std::string path = folder_ / "growing";
  write_file(path, std::string(std::size_t{64} << 20, 'x'));
  EXPECT_EQ(read_file(path).size(), std::size_t{64} << 20);
  std::atomic<bool> stop{false}, started{false};
  std::thread writer([&] {
    std::ofstream out(path, std::ios::app);
    while (!stop) {
      out << 'y' << std::flush;
      started = true;
    }
  });
  while (!started) std::this_thread::yield();
  std::string message;
  try {
    read_file(path);
  } catch (const Error& error) {
    message = error.what();
  }
  stop = true;
  writer.join();
  EXPECT_EQ(message, path + ": changed while it was read");
}

TEST_F(FileTest, LargeFilesAreRejectedBeforeTheyAreRead) {
  const std::string path = folder_ / "sparse";
  write_file(path, "x");
  std::filesystem::resize_file(path, std::uintmax_t{1} << 40);
  EXPECT_THROW(read_file(path), Error);
}

TEST_F(FileTest, PngKeepsEveryPixel) {
  std::vector<uint8_t> rgb;
  for (int i = 0; i < 5 * 3 * 3; ++i) rgb.push_back(static_cast<uint8_t>(i * 5));
  write_png(folder_ / "a.png", 5, 3, rgb);
  const RgbImage image = read_png(folder_ / "a.png");
  EXPECT_EQ(image.width_px, 5);
  EXPECT_EQ(image.height_px, 3);
  EXPECT_EQ(image.rgb, rgb);
  EXPECT_THROW(write_png(folder_ / "b.png", 5, 4, rgb), Error);
}

TEST_F(FileTest, AFifoIsReadToItsEndAndItsWaitCanBeInterrupted) {
  const std::string path = folder_ / "fifo";
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  std::thread writer([&] { std::ofstream(path) << std::string(200'000, 'x'); });
  EXPECT_EQ(read_file(path).size(), 200'000u);
  writer.join();
  EXPECT_EXIT(
      {
        catch_interrupts();
        ::raise(SIGTERM);
        std::fputs(test::message_of<Interrupted>([&] { read_file(path); }).c_str(), stderr);
        std::exit(0);
      },
      testing::ExitedWithCode(0), "fifo: interrupted while it was read");
}

TEST_F(FileTest, ACacheMustBeARegularFile) {
  const std::string fifo = folder_ / "fifo", device = folder_ / "device", file = folder_ / "file";
  ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
  std::filesystem::create_symlink("/dev/zero", device);
  for (const std::string& path : {fifo, device}) {
    EXPECT_THAT(test::message_of([&] { read_cached(path); }), testing::HasSubstr("expected a regular file")) << path;
  }
  EXPECT_EQ(read_cached(folder_ / "none"), std::nullopt);
  write_to_cache(fifo, "x");
  write_to_cache(file, "x");
  EXPECT_EQ(read_cached(file), "x");
  EXPECT_TRUE(std::filesystem::is_fifo(fifo));
}

TEST_F(FileTest, TheHashOfAFileIsThatOfAllItsBytes) {
  const std::string path = folder_ / "scene.bin", bytes(200'000, 'x');
  std::ofstream(path) << bytes;
  EXPECT_EQ(hash_of_file(path), fmt::format("{:016x}", hash_of(bytes)));
  EXPECT_THAT(test::message_of<Error>([&] { hash_of_file(folder_ / "none"); }),
              testing::HasSubstr("none: no such file"));
  EXPECT_THAT(test::message_of<Error>([&] { hash_of_file(folder_.path()); }),
              testing::HasSubstr("expected a file, got a folder"));
}

TEST(Hash, IsFnv1a) {
  Hash64 hash;
  hash.add_bytes("a", 1);
  EXPECT_EQ(hash.hex(), "af63dc4c8601ec8c");  // published test vector of FNV-1a, 64 bits
}

}  // namespace
}  // namespace pictura
