#pragma once

#include <meniscus/base/function_ref.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>

namespace meniscus {

/// Settings of a RunControl.
struct RunOptions {
  std::optional<int> threads;  ///< worker threads, >= 1; all cores when not given. Results never depend on it.
  std::uint64_t seed = 0;      ///< key of every random number drawn by the job
  /// Called with a fraction in [0, 1] that never goes backwards and the name of the stage; may come from any thread,
  /// one call at a time.
  std::function<void(double fraction, std::string_view stage)> on_progress;
};

/// How a long job is run: cancel from any thread, progress, thread count, seed. Copies share one state.
/// Passed last to every long function. Jobs look at `cancelled` at least once per block of parallel work.
class RunControl {
 public:
  RunControl();
  /// Throws InvalidInput for fewer than one thread.
  explicit RunControl(RunOptions options);

  /// Asks the job to stop; it answers by throwing Cancelled. Safe from any thread and from a signal handler.
  void cancel() const noexcept;
  bool cancelled() const noexcept;
  /// Throws Cancelled if cancel() was called.
  void check() const;

  /// Reports progress of this part of the job, 0 to 1. Values below an earlier one are ignored.
  void progress(double fraction, std::string_view stage = {}) const;
  /// A control for a sub-job that fills [begin, end] of this one's progress.
  RunControl part(double begin, double end) const;

  int threads() const;
  std::uint64_t seed() const;

  /// Runs `work` with this control's thread limit; parallel loops inside obey it.
  void execute(FunctionRef<void()> work) const;

 private:
  struct State;
  std::shared_ptr<State> state_;
  double begin_ = 0;
  double end_ = 1;
};

}  // namespace meniscus
