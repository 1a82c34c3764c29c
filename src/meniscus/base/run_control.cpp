#include <meniscus/base/error.h>
#include <meniscus/base/run_control.h>

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <mutex>

namespace meniscus {

struct RunControl::State {
  explicit State(RunOptions o)
      : options(std::move(o)), arena(options.threads ? *options.threads : int{tbb::task_arena::automatic}) {
    using tbb::global_control;
    const auto wanted = static_cast<std::size_t>(arena.max_concurrency());
    if (wanted > global_control::active_value(global_control::max_allowed_parallelism)) {
      more_threads.emplace(global_control::max_allowed_parallelism, wanted);
    }
  }

  RunOptions options;
  tbb::task_arena arena;
  // TBB gives no more threads than there are cores, and prints a warning when asked for more, unless it is told otherwise.
  std::optional<tbb::global_control> more_threads;
  std::atomic<bool> cancelled{false};
  std::mutex progress_mutex;
  double reported = -1;
};

RunControl::RunControl() : RunControl(RunOptions{}) {}

RunControl::RunControl(RunOptions options) {
  if (options.threads && *options.threads < 1) throw InvalidInput("threads must be at least 1");
  state_ = std::make_shared<State>(std::move(options));
}

void RunControl::cancel() const noexcept { state_->cancelled.store(true, std::memory_order_relaxed); }

bool RunControl::cancelled() const noexcept { return state_->cancelled.load(std::memory_order_relaxed); }

void RunControl::check() const {
  if (cancelled()) throw Cancelled();
}

void RunControl::progress(double fraction, std::string_view stage) const {
  if (!state_->options.on_progress) return;
  const double overall = begin_ + (end_ - begin_) * std::clamp(fraction, 0.0, 1.0);
  const std::lock_guard lock(state_->progress_mutex);
  if (overall <= state_->reported) return;
  state_->reported = overall;
  state_->options.on_progress(overall, stage);
}

RunControl RunControl::part(double begin, double end) const {
  RunControl sub = *this;
  sub.begin_ = begin_ + (end_ - begin_) * begin;
  sub.end_ = begin_ + (end_ - begin_) * end;
  return sub;
}

int RunControl::threads() const { return state_->arena.max_concurrency(); }

std::uint64_t RunControl::seed() const { return state_->options.seed; }

void RunControl::execute(FunctionRef<void()> work) const {
  state_->arena.execute([&] { work(); });
}

}  // namespace meniscus
