// Writer of videos, which sends frames of raw pixels to the ffmpeg program.
#pragma once

#include <memory>
#include <string>

#include "pictura/common/image.h"

namespace pictura {

/// Writer of one video, frame by frame. The file has its name only after finish() has returned; an unfinished video
/// leaves no file. The extension selects the format: .mp4 (H.264, yuv420p) or .gif (one palette per video). If a side
/// of an .mp4 is odd, its last row or column is dropped. An object must be used by one thread only.
class VideoWriter {
 public:
  /// Throws UsageError for any other extension. Throws Error if the folder is not writable or ffmpeg cannot be started.
  VideoWriter(const std::string& path, int width_px, int height_px, double frames_per_s);
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  /// Adds a frame. Throws Error if the frame has another size. If ffmpeg has ended, throws Error with ffmpeg's last
  /// line of output.
  void add(const RgbImage& frame);
  /// Completes the video and gives the file its name. Throws Error if ffmpeg failed or no frame was added.
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pictura
