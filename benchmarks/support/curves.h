#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

namespace meniscus::bench {

/// Curves over frames, several in a panel: as CSV, as a table of means and extremes, and as an SVG picture.
class Curves {
 public:
  /// `panel` names the quantity and its unit, "flicker, voxels per frame²"; the part after the comma stands at the axis.
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

  /// All panels below one another over the same frames.
  std::string svg(const std::string& title) const {
    const double height = kTitle + static_cast<double>(panels_.size()) * kPanel;
    std::string out = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + number(kWidth) + "\" height=\"" +
                      number(height) +
                      "\" font-family=\"DejaVu Sans, Helvetica, sans-serif\" font-size=\"12\">\n"
                      "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
    out += text(kLeft, 22, title, "font-size=\"15\" font-weight=\"bold\"");
    double first = 1e300, last = -1e300;
    for (const Panel& p : panels_)
      for (const Line& l : p.lines)
        first = std::min(first, l.points.front().first), last = std::max(last, l.points.back().first);
    for (std::size_t i = 0; i < panels_.size(); ++i)
      out += panel(panels_[i], kTitle + static_cast<double>(i) * kPanel, first, last);
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
  struct Range {
    double low, high, step;
  };

  static constexpr double kWidth = 760, kLeft = 72, kRight = 118, kTitle = 36, kPanel = 224, kHeight = 140, kTop = 28;

  static std::string number(double v) {
    char out[32];
    std::snprintf(out, sizeof out, "%.4g", std::abs(v) < 1e-12 ? 0 : v);
    return out;
  }
  static std::string text(double x, double y, const std::string& s, const std::string& more) {
    return "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\" " + more + ">" + s + "</text>\n";
  }
  static std::string segment(double x, double y, double to_x, double to_y, const char* colour) {
    return "<line x1=\"" + number(x) + "\" y1=\"" + number(y) + "\" x2=\"" + number(to_x) + "\" y2=\"" + number(to_y) +
           "\" stroke=\"" + colour + "\"/>\n";
  }
  /// Round numbers about [low, high]: steps of 1, 2 or 5 times a power of ten.
  static Range round(double low, double high, int ticks) {
    if (!(high > low)) high = low + 1;
    const double raw = (high - low) / ticks, power = std::pow(10, std::floor(std::log10(raw)));
    const double step = power * (raw <= power ? 1 : raw <= 2 * power ? 2 : raw <= 5 * power ? 5 : 10);
    return {step * std::floor(low / step + 1e-9), step * std::ceil(high / step - 1e-9), step};
  }

  static std::string panel(const Panel& p, double top, double first, double last) {
    static const char* const kColours[] = {"#0b6e99", "#d9730d", "#6f6f6f"};
    double low = 0, high = 0;
    for (const Line& l : p.lines)
      for (const auto& [x, y] : l.points) low = std::min(low, y), high = std::max(high, y);
    const Range y = round(low, high, 5), x = round(first, last, 10);
    const auto px = [&](double v) { return kLeft + (kWidth - kLeft - kRight) * (v - first) / std::max(last - first, 1e-9); };
    const auto py = [&](double v) { return top + kTop + kHeight * (y.high - v) / (y.high - y.low); };
    const std::size_t comma = p.name.rfind(", ");
    std::string out = text(kLeft, top + 18, p.name.substr(0, comma), "font-weight=\"bold\"");
    for (double v = y.low; v <= y.high + 0.5 * y.step; v += y.step) {
      out += segment(kLeft, py(v), kWidth - kRight, py(v), std::abs(v) < 1e-9 * y.step ? "#999" : "#e4e4e4");
      out += text(kLeft - 8, py(v) + 4, number(v), "text-anchor=\"end\" fill=\"#555\"");
    }
    for (double v = x.low; v <= last; v += x.step) {
      if (v < first) continue;
      out += segment(px(v), py(y.low), px(v), py(y.low) + 4, "#999");
      out += text(px(v), py(y.low) + 17, number(v), "text-anchor=\"middle\" fill=\"#555\"");
    }
    out += text(0.5 * (kLeft + kWidth - kRight), py(y.low) + 34, "frame", "text-anchor=\"middle\" fill=\"#555\"");
    const double middle = top + kTop + 0.5 * kHeight;
    if (comma != std::string::npos)
      out += text(18, middle, p.name.substr(comma + 2),
                  "text-anchor=\"middle\" fill=\"#555\" transform=\"rotate(-90 18 " + number(middle) + ")\"");
    for (std::size_t i = 0; i < p.lines.size(); ++i) {
      const std::string colour = kColours[i % 3];
      std::string path;
      for (const auto& [a, b] : p.lines[i].points) path += number(px(a)) + "," + number(py(b)) + " ";
      out += "<polyline fill=\"none\" stroke-width=\"1.8\" stroke-linejoin=\"round\" stroke=\"" + colour + "\" points=\"" +
             path + "\"/>\n";
      const double key = top + kTop + 8 + 18 * static_cast<double>(i);
      out += segment(kWidth - kRight + 10, key, kWidth - kRight + 28, key, colour.c_str());
      out += text(kWidth - kRight + 33, key + 4, p.lines[i].name, "fill=\"" + colour + "\"");
    }
    return out;
  }

  std::vector<Panel> panels_;
};

}  // namespace meniscus::bench
