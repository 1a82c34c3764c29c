#pragma once

#include <meniscus/io/geometry.h>
#include <meniscus/pointset/normals.h>
#include <meniscus/pointset/sculptor.h>
#include <meniscus/scene/sculpt_script.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace meniscus::scene {

/// A cloud in; the same after a script of strokes, and if wanted its motion, out.
struct SculptJobOptions {
  pointset::NormalOptions normals;
  pointset::FitOptions fit;
  bool resample = true;      ///< keep the points' spacing
  std::string output;        ///< the final cloud: "out.ply"
  std::vector<long> frames;  ///< steps of the motion, counted from 1 over all strokes, to be written beside it
  io::WriteOptions write;
};

/// What became of one command of the script.
struct SculptJobStroke {
  std::string label;
  std::string where;
  pointset::StrokeReport report;
};

struct SculptJobFrame {
  long frame = 0;
  std::string path;
  std::size_t points = 0;
  Box bounds;
};

struct SculptJobReport {
  io::ReadReport read;
  pointset::NormalReport normals;
  pointset::FitReport fit;
  std::vector<SculptJobStroke> strokes;
  std::vector<SculptJobFrame> frames;
  long steps = 0;  ///< of the motion: as many frames could be had
  points::Cloud result;
};

/// "out.ply" -> "out.0007.ply".
std::string motion_path(const std::string& output, long frame);

/// Fits the cloud `input`, does the commands in order and writes the result. Throws IoError, InvalidInput, Cancelled; then
/// the final cloud is not written.
SculptJobReport run_sculpt_job(const std::string& input, const SculptScript& script, const SculptJobOptions& options,
                               const std::function<void(const SculptJobStroke&)>& on_stroke = {}, RunControl run = {});

}  // namespace meniscus::scene
