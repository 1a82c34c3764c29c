#include <meniscus/render/text.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace meniscus::render {
namespace {

constexpr int kColumns = 5;
constexpr int kRows = 8;        // seven rows of a capital and one below the base line
constexpr double kAdvance = 6;  // in dots

// A dot font. Each glyph is 8 rows, one base-32 digit a row (five dots, the left one is 16); from ' ' to '~'.
constexpr std::array<std::string_view, 95> kGlyphs = {"00000000", "44444040", "aa000000", "aavavaa0", "4fke5u40",
                                                      "op248j30", "cikalid0", "44000000", "24888420", "84222480",  // ' '-)
                                                      "04lel400", "044v4400", "00000448", "000v0000", "00000cc0",
                                                      "01248g00", "ehjlphe0", "4c4444e0", "eh1248v0", "v2421he0",  // *-3
                                                      "26aiv220", "vgu11he0", "68guhhe0", "v1248880", "ehhehhe0",
                                                      "ehhf12c0", "0cc0cc00", "0cc0cc48", "248g8420", "00v0v000",  // 4-=
                                                      "84212480", "eh124040", "eh1dlle0", "ehhhvhh0", "uhhuhhu0",
                                                      "ehggghe0", "sihhhis0", "vgguggv0", "vgguggg0", "ehgjhhf0",  // >-G
                                                      "hhhvhhh0", "e44444e0", "72222ic0", "hikokih0", "ggggggv0",
                                                      "hrllhhh0", "hhpljhh0", "ehhhhhe0", "uhhuggg0", "ehhhlid0",  // H-Q
                                                      "uhhukih0", "fgge11u0", "v4444440", "hhhhhhe0", "hhhhha40",
                                                      "hhhllla0", "hha4ahh0", "hhha4440", "v1248gv0", "e88888e0",  // R-[
                                                      "0g842100", "e22222e0", "4ah00000", "0000000v", "84000000",
                                                      "00e1fhf0", "ggmphhu0", "00eggge0", "11djhhf0", "00ehvge0",  // \-e
                                                      "698s8880", "00fhhf1e", "ggmphhh0", "40c444e0", "2062222c",
                                                      "ggikoki0", "c44444e0", "00qlllh0", "00mphhh0", "00ehhhe0",  // f-o
                                                      "00uhhugg", "00djhf11", "00mpggg0", "00fge1u0", "88s88960",
                                                      "00hhhjd0", "00hhha40", "00hhlla0", "00ha4ah0", "00hhhf1e",   // p-y
                                                      "00v248v0", "24484420", "44444440", "84424480", "008l2000"};  // z-~

int row_bits(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'v') return c - 'a' + 10;
  return 0;
}

struct Glyph {
  std::array<std::array<bool, kColumns>, kRows> dots{};
  bool at(int x, int y) const {
    return x >= 0 && y >= 0 && x < kColumns && y < kRows && dots[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)];
  }
};

Glyph glyph_of(char c) {
  const std::string_view rows = c >= ' ' && c <= '~' ? kGlyphs[static_cast<std::size_t>(c - ' ')] : "vhhhhhv0";
  Glyph glyph;
  for (std::size_t y = 0; y < kRows; ++y) {
    for (std::size_t x = 0; x < kColumns; ++x) glyph.dots[y][x] = (row_bits(rows[y]) >> (kColumns - 1 - x) & 1) != 0;
  }
  return glyph;
}

double distance_to_segment(const Vec2& p, const Vec2& a, const Vec2& b) {
  const Vec2 ab = b - a;
  const double t = ab.squaredNorm() > 0 ? std::clamp((p - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0) : 0;
  return (p - a - t * ab).norm();
}

// Dots are joined to their neighbours, diagonally only where no straight way leads: strokes instead of steps.
double distance_to_glyph(const Glyph& glyph, const Vec2& p) {
  double best = 1e9;
  for (int y = 0; y < kRows; ++y) {
    for (int x = 0; x < kColumns; ++x) {
      if (!glyph.at(x, y)) continue;
      const Vec2 here(x, y);
      best = std::min(best, (p - here).norm());
      if (glyph.at(x + 1, y)) best = std::min(best, distance_to_segment(p, here, Vec2(x + 1, y)));
      if (glyph.at(x, y + 1)) best = std::min(best, distance_to_segment(p, here, Vec2(x, y + 1)));
      for (const int dx : {-1, 1}) {
        const bool diagonal = glyph.at(x + dx, y + 1) && !glyph.at(x + dx, y) && !glyph.at(x, y + 1);
        if (diagonal) best = std::min(best, distance_to_segment(p, here, Vec2(x + dx, y + 1)));
      }
    }
  }
  return best;
}

}  // namespace

double text_width(std::string_view text, double height) {
  return text.empty() ? 0 : (kAdvance * static_cast<double>(text.size()) - 1) * height / 7;
}

void draw_text(Image& image, double x, double y, std::string_view text, double height, const Vec3& color) {
  const double dot = height / 7;
  const double half_stroke = 0.42;  // in dots
  for (const char c : text) {
    const Glyph glyph = glyph_of(c);
    const int left = static_cast<int>(std::floor(x - dot));
    const int top = static_cast<int>(std::floor(y - dot));
    for (int j = top; j <= top + static_cast<int>(std::ceil(10 * dot)); ++j) {
      for (int i = left; i <= left + static_cast<int>(std::ceil(7 * dot)); ++i) {
        const Vec2 p((i + 0.5 - x) / dot - 0.5, (j + 0.5 - y) / dot - 0.5);
        const double opacity = std::clamp((half_stroke - distance_to_glyph(glyph, p)) * dot + 0.5, 0.0, 1.0);
        if (opacity > 0) blend(image, i, j, color, opacity);
      }
    }
    x += kAdvance * dot;
  }
}

}  // namespace meniscus::render
