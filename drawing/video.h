// Film: frames of raw pixels piped into the ffmpeg program.
#pragma once

#include <memory>
#include <string>

#include "pictura/common/image.h"

namespace pictura {

/// Writes a film frame by frame; the file appears under its name when finish() has returned. The ending of the path
/// chooses the format: .mp4 (H.264, yuv420p; an odd side loses its last row or column) or .gif (one palette per film).
/// Serves one thread; an unfinished film leaves no file.
class VideoWriter {
 public:
  /// Throws UsageError for another ending, Error when the folder cannot be written to or ffmpeg cannot be started.
  VideoWriter(const std::string& path, int width_px, int height_px, double frames_per_s);
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  /// Throws Error when the frame has another size, or with the last line that ffmpeg said when it has ended.
  void add(const RgbImage& frame);
  /// Ends the film and puts it under its name. Throws Error when ffmpeg failed or there is no frame.
  void finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pictura
