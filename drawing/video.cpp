#include "pictura/drawing/video.h"

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "pictura/common/error.h"
#include "pictura/common/support/output_file.h"

extern char** environ;

namespace pictura {

namespace fs = std::filesystem;

namespace {

// Descriptor of the output file in the ffmpeg process.
constexpr int kFilmInChild = 3;

std::string last_line(std::FILE* file) {
  std::rewind(file);
  std::string line, last;
  for (int c = std::fgetc(file); c != EOF; c = std::fgetc(file)) {
    if (c != '\n' && c != '\r') {
      line += static_cast<char>(c);
    } else if (!line.empty()) {
      last = std::exchange(line, {});
    }
  }
  return line.empty() ? last : line;
}

}  // namespace

struct VideoWriter::Impl {
  std::string path;
  std::optional<OutputFile> film;
  int width_px = 0, height_px = 0;
  int64_t num_frames = 0;
  pid_t child = -1;
  // A socket instead of a pipe, because send() can write without raising SIGPIPE when the reader has ended.
  Descriptor frames;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> messages{nullptr, std::fclose};

  ~Impl() {
    frames.reset();
    if (child >= 0) {
      ::kill(child, SIGKILL);
      reap();
    }
  }

  void start(std::vector<std::string> arguments);

  int reap() {
    int status = 0;
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    child = -1;
    return status;
  }

  /// Throws Error with ffmpeg's last line.
  [[noreturn]] void fail_with_message(int status) {
    const std::string said = last_line(messages.get());
    const std::string how = WIFSIGNALED(status) ? fmt::format("ended by signal {}", WTERMSIG(status))
                                                : fmt::format("ended with status {}", WEXITSTATUS(status));
    fail("{}: ffmpeg {}{}{}", path, how, said.empty() ? "" : ": ", said);
  }
};

void VideoWriter::Impl::start(std::vector<std::string> arguments) {
  int ends[2];
  PICTURA_CHECK(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) == 0,
                "{}: cannot open a socket for ffmpeg: {}", path, std::strerror(errno));
  frames.reset(ends[0]);
  const Descriptor child_end(ends[1]);
  messages.reset(std::tmpfile());
  PICTURA_CHECK(messages, "{}: cannot create a file for ffmpeg's messages: {}", path, std::strerror(errno));

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, child_end.get(), STDIN_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, ::fileno(messages.get()), STDERR_FILENO);
  posix_spawn_file_actions_adddup2(&actions, film->fd(), kFilmInChild);
  // ffmpeg runs in its own process group, so that ^C in a terminal does not end ffmpeg before this process has finished
  // the video.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  posix_spawnattr_setpgroup(&attributes, 0);
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const int code = ::posix_spawnp(&child, argv[0], &actions, &attributes, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  if (code != 0) {
    child = -1;
    fail("{}: films need the ffmpeg program, which cannot be started: {}", path, std::strerror(code));
  }
}

VideoWriter::VideoWriter(const std::string& path, int width_px, int height_px, double frames_per_s)
    : impl_(std::make_unique<Impl>()) {
  const fs::path target(path);
  const std::string ending = target.extension().string();
  if (ending != ".mp4" && ending != ".gif") fail_usage("{}: expected a film's name to end with .mp4 or .gif", path);
  PICTURA_CHECK(width_px >= 2 && height_px >= 2 && width_px <= 8192 && height_px <= 8192,
                "{}: expected frames of 2 to 8192 px per side, got {}x{}", path, width_px, height_px);
  PICTURA_CHECK(frames_per_s > 0 && frames_per_s <= 1000, "{}: expected at most 1000 frames per second, got {}", path,
                frames_per_s);
  impl_->path = path;
  impl_->width_px = width_px;
  impl_->height_px = height_px;
  impl_->film.emplace(path);
  std::vector<std::string> arguments{"ffmpeg",
                                     "-hide_banner",
                                     "-loglevel",
                                     "error",
                                     "-nostdin",
                                     "-y",
                                     "-f",
                                     "rawvideo",
                                     "-pixel_format",
                                     "rgb24",
                                     "-video_size",
                                     fmt::format("{}x{}", width_px, height_px),
                                     "-framerate",
                                     fmt::format("{}", frames_per_s),
                                     "-i",
                                     "pipe:0"};
  const std::vector<std::string> format =
      ending == ".mp4" ? std::vector<std::string>{"-vf",       "crop=trunc(iw/2)*2:trunc(ih/2)*2:0:0",
                                                  "-c:v",      "libx264",
                                                  "-preset",   "veryfast",
                                                  "-crf",      "20",
                                                  "-pix_fmt",  "yuv420p",
                                                  "-movflags", "+faststart",
                                                  "-f",        "mp4"}
                       : std::vector<std::string>{
                             "-filter_complex",
                             "split[a][b];[a]palettegen[p];[b][p]paletteuse=dither=bayer:bayer_scale=4", "-f", "gif"};
  arguments.insert(arguments.end(), format.begin(), format.end());
  // The output is a path to the descriptor: the file may have no name yet, and ffmpeg must be able to read the file
  // again to move its index to the front.
  arguments.push_back(fmt::format("file:/proc/self/fd/{}", kFilmInChild));
  impl_->start(std::move(arguments));
}

VideoWriter::~VideoWriter() = default;

void VideoWriter::add(const RgbImage& frame) {
  PICTURA_CHECK(impl_->child >= 0, "{}: the film has ended", impl_->path);
  PICTURA_CHECK(
      frame.width_px == impl_->width_px && frame.height_px == impl_->height_px &&
          frame.rgb.size() == size_t{3} * static_cast<size_t>(frame.width_px) * static_cast<size_t>(frame.height_px),
      "{}: expected a frame of {}x{} px, got {}x{}", impl_->path, impl_->width_px, impl_->height_px, frame.width_px,
      frame.height_px);
  for (size_t sent = 0; sent < frame.rgb.size();) {
    const ssize_t count = ::send(impl_->frames.get(), frame.rgb.data() + sent, frame.rgb.size() - sent, MSG_NOSIGNAL);
    if (count >= 0) {
      sent += static_cast<size_t>(count);
    } else if (errno != EINTR) {
      impl_->frames.reset();
      impl_->fail_with_message(impl_->reap());
    }
  }
  ++impl_->num_frames;
}

void VideoWriter::finish() {
  PICTURA_CHECK(impl_->child >= 0, "{}: the film has ended", impl_->path);
  PICTURA_CHECK(impl_->num_frames > 0, "{}: expected at least one frame, got none", impl_->path);
  impl_->frames.reset();
  const int status = impl_->reap();
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) impl_->fail_with_message(status);
  PICTURA_CHECK(::lseek(impl_->film->fd(), 0, SEEK_END) > 0, "{}: ffmpeg wrote nothing", impl_->path);
  impl_->film->commit();
}

}  // namespace pictura
