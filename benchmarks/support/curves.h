#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace meniscus::bench {

/// Curves over frames, several in a panel: as CSV, as a table of means and extremes, and as an SVG picture.
class Curves {
 public:
  void add(const std::string& panel, double x, const std::vector<std::pair<std::string, double>>& values) {
    auto at = std::find_if(panels_.begin(), panels_.end(), [&](const Panel& p) { return p.name == panel; });
    if (at == panels_.end()) at = panels_.insert(at, {panel, {}});
    for (const auto& [name, y] : values) {
      auto line = std::find_if(at->lines.begin(), at->lines.end(), [&, n = name](const Line& l) { return l.name == n; });
      if (line == at->lines.end()) line = at->lines.insert(line, {name, {}});
      line->points.emplace_back(x, y);
    }
  }

  std::string markdown() const {
    std::string out = "| figure | of | mean | largest size |\n|---|---|---|---|\n";
    for (const Panel& p : panels_)
      for (const Line& l : p.lines) {
        double sum = 0, most = 0;
        for (const auto& [x, y] : l.points) {
          sum += y;
          most = std::max(most, std::abs(y));
        }
        out += "| " + p.name + " | " + l.name + " | " + number(sum / static_cast<double>(l.points.size())) + " | " +
               number(most) + " |\n";
      }
    return out;
  }

  std::string csv() const {
    std::string out = "figure,of,frame,value\n";
    for (const Panel& p : panels_)
      for (const Line& l : p.lines)
        for (const auto& [x, y] : l.points) out += '"' + p.name + "\"," + l.name + ',' + number(x) + ',' + number(y) + '\n';
    return out;
  }

  std::string svg() const {
    constexpr double kWidth = 720, kHeight = 150, kLeft = 56, kTop = 30, kRight = 90;
    static const char* const kColours[] = {"#0b6e99", "#d9730d", "#8f8f8f"};
    const double whole = static_cast<double>(panels_.size()) * (kHeight + 48) + 20;
    std::string out =
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"720\" height=\"" + number(whole) +
        "\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
    double top = kTop;
    for (const Panel& p : panels_) {
      double low = 0, high = 0, first = 1e300, last = -1e300;
      for (const Line& l : p.lines)
        for (const auto& [x, y] : l.points) {
          low = std::min(low, y);
          high = std::max(high, y);
          first = std::min(first, x);
          last = std::max(last, x);
        }
      if (high <= low) high = low + 1;
      if (last <= first) last = first + 1;
      const auto px = [&](double x) { return kLeft + (kWidth - kLeft - kRight) * (x - first) / (last - first); };
      const auto py = [&](double y) { return top + kHeight * (high - y) / (high - low); };
      const auto text = [&](double x, double y, const std::string& s, const char* more) {
        out += "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\" " + more + ">" + s + "</text>\n";
      };
      text(kLeft, top - 8, p.name, "font-weight=\"bold\"");
      for (const double y : {low, 0.0, high}) {
        out += "<line x1=\"" + number(kLeft) + "\" x2=\"" + number(kWidth - kRight) + "\" y1=\"" + number(py(y)) +
               "\" y2=\"" + number(py(y)) + "\" stroke=\"#ddd\"/>\n";
        text(kLeft - 6, py(y) + 4, number(y), "text-anchor=\"end\" fill=\"#666\"");
      }
      text(px(first), top + kHeight + 14, number(first), "text-anchor=\"middle\" fill=\"#666\"");
      text(px(last), top + kHeight + 14, number(last) + " frame", "text-anchor=\"middle\" fill=\"#666\"");
      // Names stand beside the ends of their lines, apart from each other.
      std::vector<std::pair<double, std::size_t>> ends;
      for (std::size_t i = 0; i < p.lines.size(); ++i) {
        std::string path;
        for (const auto& [x, y] : p.lines[i].points) path += number(px(x)) + "," + number(py(y)) + " ";
        out += "<polyline fill=\"none\" stroke-width=\"1.6\" stroke=\"" + std::string(kColours[i % 3]) + "\" points=\"" +
               path + "\"/>\n";
        ends.emplace_back(py(p.lines[i].points.back().second), i);
      }
      std::sort(ends.begin(), ends.end());
      double y = -1e300;
      for (const auto& [end, i] : ends) {
        y = std::max(y + 14, end + 4);
        text(kWidth - kRight + 6, y, p.lines[i].name, (std::string("fill=\"") + kColours[i % 3] + "\"").c_str());
      }
      top += kHeight + 48;
    }
    return out + "</svg>\n";
  }

 private:
  struct Line {
    std::string name;
    std::vector<std::pair<double, double>> points;
  };
  struct Panel {
    std::string name;
    std::vector<Line> lines;
  };
  static std::string number(double v) {
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", v);
    return text;
  }
  std::vector<Panel> panels_;
};

}  // namespace meniscus::bench
