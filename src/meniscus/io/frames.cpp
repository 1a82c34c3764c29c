#include <meniscus/base/error.h>
#include <meniscus/io/frames.h>

#include <algorithm>
#include <charconv>
#include <filesystem>

namespace meniscus::io {
namespace {

constexpr std::size_t kMostFrames = 1'000'000;
constexpr std::size_t kMostDigits = 9;

bool digit(char c) { return c >= '0' && c <= '9'; }

std::size_t digits_at(std::string_view text, std::size_t at) {
  std::size_t n = 0;
  while (at + n < text.size() && digit(text[at + n])) ++n;
  return n;
}

std::optional<long> whole_number(std::string_view text) {
  long value = 0;
  if (text.empty() || text.size() > kMostDigits || digits_at(text, 0) != text.size()) return std::nullopt;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

/// One item of a range: "5", "12-20", "1-100x2".
void add_range(std::string_view item, std::string_view whole, std::vector<long>& frames) {
  const std::size_t dash = std::min(item.find('-'), item.size());
  const std::size_t cross = std::min(item.find('x', dash), item.size());
  const auto first = whole_number(item.substr(0, dash));
  const auto last = dash == item.size() ? first : whole_number(item.substr(dash + 1, cross - dash - 1));
  const auto step = cross == item.size() ? std::optional<long>(1) : whole_number(item.substr(cross + 1));
  if (!first || !last || !step || *step == 0 || *last < *first)
    throw InvalidInput("frames '" + std::string(whole) + "': '" + std::string(item) +
                       "' is no frame or range (write 1-48, 1-100x2 or 5,9,12-20)");
  if (static_cast<std::size_t>((*last - *first) / *step) + frames.size() >= kMostFrames)
    throw InvalidInput("frames '" + std::string(whole) + "': more than a million frames");
  for (long f = *first; f <= *last; f += *step) frames.push_back(f);
}

/// A place for the number within a name.
struct Place {
  std::size_t begin = 0, length = 0, width = 0;
};

std::optional<Place> place_at(std::string_view name, std::size_t at) {
  const std::string_view rest = name.substr(at);
  if (rest.starts_with('#')) {
    const std::size_t n = std::min(rest.find_first_not_of('#'), rest.size());
    return Place{at, n, n > 1 ? n : 0};
  }
  if (rest.starts_with("{}")) return Place{at, 2, 0};
  if (!rest.starts_with('%') && !rest.starts_with("$F")) return std::nullopt;
  const bool percent = rest.starts_with('%');
  const std::size_t skip = percent ? 1 : 2;
  const std::size_t digits = digits_at(rest, skip);
  if (percent && (skip + digits >= rest.size() || rest[skip + digits] != 'd')) return std::nullopt;
  const auto width = whole_number(rest.substr(skip, digits)).value_or(0);
  return Place{at, skip + digits + (percent ? 1 : 0), std::min<std::size_t>(static_cast<std::size_t>(width), kMostDigits)};
}

/// The text between the numbers of a name, and the numbers.
struct SplitName {
  std::vector<std::string> texts, numbers;
};

SplitName split(const std::string& name) {
  SplitName out;
  out.texts.emplace_back();
  for (std::size_t i = 0; i < name.size();) {
    if (const std::size_t n = digits_at(name, i); n > 0) {
      out.numbers.push_back(name.substr(i, n));
      out.texts.emplace_back();
      i += n;
    } else {
      out.texts.back() += name[i++];
    }
  }
  return out;
}

/// Which number of the names counts the frames: the only one that differs.
std::optional<std::size_t> counting_number(const std::vector<SplitName>& names) {
  std::optional<std::size_t> found;
  for (const SplitName& n : names) {
    if (n.texts != names.front().texts) return std::nullopt;
    for (std::size_t i = 0; i < n.numbers.size(); ++i) {
      if (n.numbers[i] == names.front().numbers[i]) continue;
      if (found && *found != i) return std::nullopt;
      found = i;
    }
  }
  return found;
}

void sort_and_check(std::vector<FrameFile>& files) {
  std::sort(files.begin(), files.end(),
            [](const FrameFile& a, const FrameFile& b) { return a.frame != b.frame ? a.frame < b.frame : a.path < b.path; });
  for (std::size_t i = 1; i < files.size(); ++i)
    if (files[i].frame == files[i - 1].frame)
      throw InvalidInput("frame " + std::to_string(files[i].frame) + " is there twice: " + files[i - 1].path + " and " +
                         files[i].path);
}

}  // namespace

std::vector<long> parse_frames(std::string_view text) {
  std::vector<long> frames;
  for (std::string_view rest = text;;) {
    const std::size_t comma = std::min(rest.find(','), rest.size());
    add_range(rest.substr(0, comma), text, frames);
    if (comma == rest.size()) break;
    rest.remove_prefix(comma + 1);
  }
  std::sort(frames.begin(), frames.end());
  frames.erase(std::unique(frames.begin(), frames.end()), frames.end());
  return frames;
}

std::optional<FramePattern> FramePattern::parse(const std::string& path) {
  std::vector<Place> places;
  for (std::size_t i = 0; i < path.size();) {
    const auto place = place_at(path, i);
    if (place) places.push_back(*place);
    i += place ? place->length : 1;
  }
  if (places.empty()) return std::nullopt;
  if (places.size() > 1) throw InvalidInput(path + ": more than one place for the frame number");
  const Place& p = places.front();
  if (path.find('/', p.begin) != path.npos)
    throw InvalidInput(path + ": the frame number must be in the file's name, not a folder's");
  FramePattern pattern;
  pattern.before_ = path.substr(0, p.begin);
  pattern.after_ = path.substr(p.begin + p.length);
  pattern.width_ = p.width;
  return pattern;
}

std::string FramePattern::path(long frame) const {
  const std::string number = std::to_string(frame);
  return before_ + std::string(width_ > number.size() ? width_ - number.size() : 0, '0') + number + after_;
}

std::vector<FrameFile> FramePattern::existing() const {
  const std::size_t slash = before_.rfind('/');
  const std::string folder = slash == before_.npos ? "" : before_.substr(0, slash + 1);
  const std::string head = before_.substr(folder.size());
  std::vector<FrameFile> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder.empty() ? "." : folder, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(head) || !name.ends_with(after_) || name.size() <= head.size() + after_.size()) continue;
    const auto frame = whole_number(std::string_view(name).substr(head.size(), name.size() - head.size() - after_.size()));
    if (frame && (width_ == 0 || path(*frame) == folder + name)) files.push_back({*frame, folder + name});
  }
  sort_and_check(files);
  return files;
}

std::vector<FrameFile> number_files(const std::vector<std::string>& paths) {
  std::vector<SplitName> names;
  names.reserve(paths.size());
  for (const std::string& p : paths) names.push_back(split(p));
  const auto counting = paths.size() > 1 ? counting_number(names) : std::nullopt;
  std::vector<FrameFile> files;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const auto number = counting ? whole_number(names[i].numbers[*counting]) : std::optional(static_cast<long>(i) + 1);
    if (!number) throw InvalidInput(paths[i] + ": the frame number has more than 9 digits");
    files.push_back({*number, paths[i]});
  }
  sort_and_check(files);
  return files;
}

}  // namespace meniscus::io
