#include <meniscus/scene/history.h>

#include <utility>

namespace meniscus::scene {

void History::apply(Document& document, Command command) {
  if (command.changes.empty()) return;
  write_parameters(document, command.changes);
  commands_.resize(done_);
  commands_.push_back(std::move(command));
  ++done_;
}

bool History::undo(Document& document) {
  if (done_ == 0) return false;
  std::vector<ParameterChange> back = commands_[done_ - 1].changes;
  for (ParameterChange& c : back) std::swap(c.before, c.after);
  write_parameters(document, back);
  --done_;
  return true;
}

bool History::redo(Document& document) {
  if (done_ == commands_.size()) return false;
  write_parameters(document, commands_[done_].changes);
  ++done_;
  return true;
}

}  // namespace meniscus::scene
