#include <meniscus/io/atomic_file.h>
#include <meniscus/io/attribute_names.h>
#include <meniscus/io/table.h>
#include <meniscus/io/text_scanner.h>

#include <algorithm>
#include <cmath>

namespace meniscus::io {
namespace {

constexpr std::size_t kMostColumns = 1000;

std::string_view trimmed(std::string_view s) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '"'; };
  while (!s.empty() && blank(s.front())) s.remove_prefix(1);
  while (!s.empty() && blank(s.back())) s.remove_suffix(1);
  return s;
}

/// Splits at every separator; a separator of ' ' stands for any run of blanks.
void split(std::string_view line, char separator, std::vector<std::string_view>& fields) {
  fields.clear();
  const std::string_view marks = separator == ' ' ? std::string_view(" \t") : std::string_view(&separator, 1);
  for (;;) {
    const std::size_t end = std::min(line.find_first_of(marks), line.size());
    const std::string_view field = trimmed(line.substr(0, end));
    if (separator != ' ' || !field.empty()) fields.push_back(field);
    if (end == line.size()) return;
    line.remove_prefix(end + 1);
  }
}

bool letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }

bool is_number(std::string_view word) {
  double value = 0;
  return parse_number(word, value);
}

/// A word, as opposed to a number or a broken number.
bool is_word(std::string_view field) { return !field.empty() && letter(field.front()) && !is_number(field); }

/// "Points:0" -> "x", "P_y" -> "y", "Velocity:2" -> "Velocity_2", "X" -> "x".
std::string column_name(std::string_view field) {
  std::string name(field);
  if (name == "X" || name == "Y" || name == "Z") name[0] = static_cast<char>(name[0] - 'A' + 'a');
  if (const std::size_t colon = name.rfind(':'); colon != name.npos) name[colon] = '_';
  for (const std::string_view stem : {"Points_", "P_", "position_", "Position_"})
    if (name.starts_with(stem) && name.size() == stem.size() + 1) {
      const std::size_t c = std::min(std::string_view("012").find(name.back()), std::string_view("xyz").find(name.back()));
      if (c != name.npos) return std::string(1, "xyz"[c]);
    }
  return name;
}

class Reader {
 public:
  Reader(const Source& source, ReadReport& report) : in_(source.bytes, source.path), path_(source.path), report_(report) {}

  RawGeometry read() {
    while (next_row()) {
      if (columns_.empty()) {
        if (is_header()) {
          read_header();
          continue;
        }
        name_columns();
      }
      if (!kinds_known_) find_words();
      read_row();
    }
    if (columns_.empty()) in_.fail("no points: lines of x y z are expected");
    return finish_columns();
  }

 private:
  /// Splits the next line that has data into fields_.
  bool next_row() {
    if (started_) in_.next_line();
    started_ = true;
    for (; in_.skip_space(); in_.next_line()) {
      std::string_view line = in_.rest_of_line();
      if (line.starts_with('#') || line.starts_with("//")) {
        if (!columns_.empty()) continue;
        line.remove_prefix(line.starts_with('#') ? 1 : 2);
        split_first(line);
        if (names_positions()) return true;
        continue;
      }
      if (columns_.empty())
        split_first(line);
      else
        split(line, separator_, fields_);
      return true;
    }
    return false;
  }

  void split_first(std::string_view line) {
    separator_ = line.find(';') != line.npos ? ';' : line.find(',') != line.npos ? ',' : ' ';
    split(line, separator_, fields_);
  }

  bool is_header() const { return !fields_.empty() && is_word(fields_.front()); }

  bool names_positions() const {
    int found = 0;
    for (const std::string_view f : fields_) {
      const std::string name = column_name(f);
      found += name == "x" || name == "y" || name == "z";
    }
    return found >= 3;
  }

  void read_header() {
    if (fields_.size() > kMostColumns) in_.fail("more than 1000 columns");
    for (const std::string_view f : fields_) columns_.push_back({column_name(f), NumberType::Float64, {}, {}});
    if (!has_position_columns(columns_)) in_.fail("the names of the columns include no x, y and z");
  }

  void name_columns() {
    if (fields_.size() < 3) in_.fail("a point needs three numbers");
    if (fields_.size() > kMostColumns) in_.fail("more than 1000 columns");
    const bool points =
        std::any_of(fields_.begin(), fields_.end(), [](std::string_view f) { return f.find('.') != f.npos; });
    if (separator_ == ',' && fields_.size() > 3 && !points)
      in_.fail("cannot tell separating commas from decimal commas; give a first line with the names of the columns");
    for (std::size_t i = 0; i < fields_.size(); ++i)
      columns_.push_back(
          {i < 3 ? std::string(1, "xyz"[i]) : "column_" + std::to_string(i + 1), NumberType::Float64, {}, {}});
  }

  void find_words() {
    kinds_known_ = true;
    words_.assign(columns_.size(), false);
    for (std::size_t i = 0; i < std::min(fields_.size(), columns_.size()); ++i)
      words_[i] = is_word(fields_[i]) && columns_[i].name != "x" && columns_[i].name != "y" && columns_[i].name != "z";
    if (std::find(words_.begin(), words_.end(), true) != words_.end())
      warn(report_, "ignored-columns", "columns of words were skipped", path_);
  }

  void read_row() {
    if (fields_.size() != columns_.size())
      in_.fail(std::to_string(fields_.size()) + " fields, expected " + std::to_string(columns_.size()));
    for (std::size_t i = 0; i < fields_.size(); ++i) {
      if (words_[i]) continue;
      double value = 0;
      if (!parse_number(fields_[i], value)) fail_number(fields_[i]);
      columns_[i].values.push_back(value);
    }
  }

  [[noreturn]] void fail_number(std::string_view field) {
    if (field.empty()) in_.fail("a number is missing");
    const bool comma = field.find(',') != field.npos || (separator_ == ',' && field.find(' ') != field.npos);
    in_.fail("not a number: '" + safe_name(field.substr(0, 40)) + "'" + (comma ? " (numbers use a decimal point)" : ""));
  }

  RawGeometry finish_columns() {
    if (!words_.empty())
      for (std::size_t i = columns_.size(); i-- > 0;)
        if (words_[i]) columns_.erase(columns_.begin() + static_cast<std::ptrdiff_t>(i));
    name_normals();
    RawGeometry out;
    if (!add_columns(std::move(columns_), out.mesh.positions, out.mesh.attributes)) in_.fail("no columns x, y and z");
    return out;
  }

  /// Six columns without names are points with normals if the last three say so.
  void name_normals() {
    if (columns_.size() != 6 || columns_[3].name != "column_4" || columns_[5].name != "column_6") return;
    for (std::size_t i = 0; i < columns_[3].values.size(); ++i) {
      const double length = Vec3(columns_[3].values[i], columns_[4].values[i], columns_[5].values[i]).norm();
      if (!(std::abs(length - 1) < 1e-2)) return;
    }
    for (std::size_t c = 0; c < 3; ++c) columns_[3 + c].name = std::string("n") + "xyz"[c];
  }

  TextScanner in_;
  std::string path_;
  ReadReport& report_;
  std::vector<std::string_view> fields_;
  std::vector<Column> columns_;
  std::vector<bool> words_;
  char separator_ = ' ';
  bool started_ = false;
  bool kinds_known_ = false;
};

void write_number(AtomicFile& file, double value, Precision precision) {
  if (precision == Precision::Float32)
    file.number(static_cast<float>(value));
  else
    file.number(value);
}

void write_number(AtomicFile& file, std::int64_t value, Precision) { file.number(value); }

}  // namespace

RawGeometry read_table(const Source& source, ReadReport& report) { return Reader(source, report).read(); }

void write_csv(AtomicFile& file, const GeometryView& g, const WriteOptions&) {
  file.write("x,y,z");
  for (const Attribute& a : g.attributes)
    for (const std::string& name : column_names(a)) file.write("," + name);
  file.put('\n');
  for (std::size_t i = 0; i < g.positions.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      if (c > 0) file.put(',');
      write_number(file, g.positions[i][c], g.precision);
    }
    for (const Attribute& a : g.attributes)
      std::visit(
          [&](const auto& values) {
            for (std::size_t c = 0; c < a.components; ++c) {
              file.put(',');
              write_number(file, values[i * a.components + c], g.precision);
            }
          },
          a.data);
    file.put('\n');
  }
}

void write_xyz(AtomicFile& file, const GeometryView& g, const WriteOptions&) {
  const auto normals = g.attributes.values(attribute::kNormal, 3);
  for (std::size_t i = 0; i < g.positions.size(); ++i) {
    for (std::size_t c = 0; c < 6; ++c) {
      if (c >= 3 && normals.empty()) break;
      if (c > 0) file.put(' ');
      write_number(file, c < 3 ? g.positions[i][static_cast<int>(c)] : normals[3 * i + c - 3], g.precision);
    }
    file.put('\n');
  }
}

}  // namespace meniscus::io
