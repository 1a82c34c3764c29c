#pragma once

#include <meniscus/scene/write_parameters.h>

#include <string>
#include <vector>

namespace meniscus::scene {

/// An edit of a document as the user sees it: one drag is one command.
struct Command {
  std::string label;
  std::vector<ParameterChange> changes;
};

/// Edits of one document that can be taken back and made again.
class History {
 public:
  /// Applies the command and remembers it; what was undone before is forgotten. Commands without changes leave no trace.
  /// Throws what write_parameters throws; document and history are then as before.
  void apply(Document& document, Command command);
  /// Takes the last command back; nothing to take back is no error. Says whether there was one.
  bool undo(Document& document);
  bool redo(Document& document);

  /// What undo and redo would act on; empty when there is nothing.
  std::string undo_label() const { return done_ > 0 ? commands_[done_ - 1].label : std::string(); }
  std::string redo_label() const { return done_ < commands_.size() ? commands_[done_].label : std::string(); }
  std::size_t size() const { return done_; }

 private:
  std::vector<Command> commands_;
  std::size_t done_ = 0;  // commands in effect; those beyond were undone
};

}  // namespace meniscus::scene
