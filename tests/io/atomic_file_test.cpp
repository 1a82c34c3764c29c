#include "support.h"

#include <meniscus/base/error.h>
#include <meniscus/io/atomic_file.h>

#include <gtest/gtest.h>

#include <sys/stat.h>
#include <algorithm>
#include <cerrno>
#include <functional>

namespace meniscus::io {
namespace {

/// Passes calls on until the n-th, which fails with an error of choice.
class FailingCalls : public FileCalls {
 public:
  explicit FailingCalls(int n, int error = ENOSPC) : left_(n), error_(error) {}
  int create(const char* path) override { return fails() ? -1 : FileCalls::create(path); }
  long write(int file, const char* data, std::size_t size) override {
    return fails() ? -1 : FileCalls::write(file, data, size);
  }
  int sync(int file) override { return fails() ? -1 : FileCalls::sync(file); }
  int rename(const char* from, const char* to, bool replace) override {
    return fails() ? -1 : FileCalls::rename(from, to, replace);
  }
  int sync_folder(const char* path) override { return fails() ? -1 : FileCalls::sync_folder(path); }
  bool reached() const { return left_ < 0; }

 private:
  bool fails() {
    if (left_-- != 0) return false;
    errno = error_;
    return true;
  }
  int left_;
  int error_;
};

/// Writes a few bytes at a time and is interrupted in between.
class HesitantCalls : public FileCalls {
 public:
  long write(int file, const char* data, std::size_t size) override {
    errno = EINTR;
    return ++calls_ % 3 == 0 ? -1 : FileCalls::write(file, data, std::min<std::size_t>(size, 1000));
  }

 private:
  int calls_ = 0;
};

std::string error_of(const std::function<void()>& work) {
  try {
    work();
  } catch (const IoError& e) {
    EXPECT_EQ(e.kind(), IoError::Kind::Write);
    return e.what();
  }
  return "no error";
}

WriteOptions replacing() {
  WriteOptions options;
  options.overwrite = true;
  return options;
}

TEST(AtomicFile, AppearsOnCommitAlone) {
  const TemporaryFolder folder;
  const std::string path = folder / "a.txt";
  {
    AtomicFile file(path, {});
    file.write("hello");
    EXPECT_FALSE(std::filesystem::exists(path));
  }
  EXPECT_EQ(folder.entries(), 0u);
  write_file(path, "hello", {});
  EXPECT_EQ(file_content(path), "hello");
  EXPECT_EQ(folder.entries(), 1u);
}

TEST(AtomicFile, ExistingFilesAreKeptWithoutForce) {
  const TemporaryFolder folder;
  const std::string path = folder / "a.txt";
  write_file(path, "old", {});
  EXPECT_EQ(error_of([&] { write_file(path, "new", {}); }),
            path + ": cannot write: the file exists (overwrite it with --force)");
  EXPECT_EQ(file_content(path), "old");
  write_file(path, "new", replacing());
  EXPECT_EQ(file_content(path), "new");
}

TEST(AtomicFile, AFileThatAppearsMeanwhileIsKept) {
  const TemporaryFolder folder;
  const std::string path = folder / "a.txt";
  AtomicFile file(path, {});
  file.write("mine");
  put_file(path, "theirs");
  EXPECT_NE(error_of([&] { file.commit(); }).find("exists"), std::string::npos);
  EXPECT_EQ(file_content(path), "theirs");
}

TEST(AtomicFile, EveryFailureLeavesTheOldFileAndNoOther) {
  const TemporaryFolder folder;
  const std::string path = folder / "a.txt";
  const std::string content(3 << 20, 'x');
  put_file(path, "old");
  bool finished = false;
  for (int n = 0; !finished; ++n) {
    ASSERT_LT(n, 50);
    FailingCalls calls(n);
    WriteOptions options = replacing();
    options.calls = &calls;
    const std::string error = error_of([&] { write_file(path, content, options); });
    EXPECT_EQ(folder.entries(), 1u) << n;
    if (!calls.reached()) {
      EXPECT_EQ(error, "no error");
      EXPECT_EQ(file_content(path), content);
      finished = true;
    } else {
      EXPECT_NE(error.find(path), std::string::npos) << error;
      EXPECT_NE(error.find("No space left"), std::string::npos) << error;
      // Only after the rename, when the folder cannot be synced, is the new content there (whole).
      const std::string now = file_content(path);
      EXPECT_TRUE(now == "old" || (now == content && error.find("sync the folder") != error.npos)) << n;
      put_file(path, "old");
    }
  }
}

TEST(AtomicFile, ShortAndInterruptedWritesAreContinued) {
  const TemporaryFolder folder;
  HesitantCalls calls;
  WriteOptions options;
  options.calls = &calls;
  std::string content;
  for (int i = 0; i < 3000; ++i) content += std::to_string(i);
  write_file(folder / "a.txt", content, options);
  EXPECT_EQ(file_content(folder / "a.txt"), content);
}

TEST(AtomicFile, ErrorsNamePathAndReason) {
  const TemporaryFolder folder;
  EXPECT_NE(error_of([&] { write_file(folder / "none/a.txt", "x", {}); }).find("does not exist"), std::string::npos);
  EXPECT_NE(error_of([&] { write_file(folder / ".", "x", replacing()); }).find("directory"), std::string::npos);
  FailingCalls refusing(0, EACCES);
  WriteOptions options;
  options.calls = &refusing;
  EXPECT_NE(error_of([&] { write_file(folder / "a.txt", "x", options); }).find("Permission denied"), std::string::npos);
  EXPECT_EQ(folder.entries(), 0u);
}

TEST(AtomicFile, LinksAreFollowedAndDevicesWritten) {
  const TemporaryFolder folder;
  put_file(folder / "real.txt", "old");
  std::filesystem::create_symlink("real.txt", folder / "link.txt");
  write_file(folder / "link.txt", "new", replacing());
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link.txt"));
  EXPECT_EQ(file_content(folder / "real.txt"), "new");
  write_file("/dev/null", "x", {});
}

TEST(AtomicFile, GeometryGoesThroughIt) {
  const TemporaryFolder folder;
  const std::string path = folder / "m.ply";
  write_mesh(path, sample_mesh());
  const std::string before = file_content(path);
  for (int n = 0; n < 4; ++n) {
    FailingCalls calls(n);
    WriteOptions options = replacing();
    options.calls = &calls;
    EXPECT_THROW(write_mesh(path, mesh::Mesh{}, options), IoError) << n;
    EXPECT_EQ(file_content(path), before) << n;
    EXPECT_EQ(folder.entries(), 1u) << n;
  }
}

}  // namespace
}  // namespace meniscus::io
