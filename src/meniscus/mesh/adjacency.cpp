#include <meniscus/mesh/adjacency.h>

#include <algorithm>

namespace meniscus::mesh {
namespace {

/// Lists from pairs (key, item) that `visit` produces twice in the same order: count, then fill.
template <class Visit>
IndexLists lists_of(std::size_t keys, const Visit& visit) {
  IndexLists lists;
  lists.begin.assign(keys + 1, 0);
  visit([&](std::int32_t key, std::int32_t) { ++lists.begin[static_cast<std::size_t>(key) + 1]; });
  for (std::size_t i = 0; i < keys; ++i) lists.begin[i + 1] += lists.begin[i];
  lists.items.resize(lists.begin.back());
  std::vector<std::size_t> next(lists.begin.begin(), lists.begin.end() - 1);
  visit([&](std::int32_t key, std::int32_t item) { lists.items[next[static_cast<std::size_t>(key)]++] = item; });
  return lists;
}

}  // namespace

IndexLists vertex_triangles(const Mesh& mesh) {
  return lists_of(mesh.positions.size(), [&](const auto& emit) {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const Triangle& tri = mesh.triangles[t];
      for (std::size_t c = 0; c < 3; ++c) {
        const bool repeated = (c > 0 && tri[c] == tri[0]) || (c > 1 && tri[c] == tri[1]);
        if (!repeated) emit(tri[c], static_cast<std::int32_t>(t));
      }
    }
  });
}

IndexLists vertex_neighbours(const Mesh& mesh) {
  const std::vector<Edge> all = edges(mesh);
  // Edges are sorted, so a first sweep over the smaller ends and a second over the larger ones leaves every list sorted.
  return lists_of(mesh.positions.size(), [&](const auto& emit) {
    for (const Edge& e : all) emit(e.b, e.a);
    for (const Edge& e : all) emit(e.a, e.b);
  });
}

std::vector<Edge> edges(const Mesh& mesh) {
  // Half-edges sorted into buckets by their smaller end; item = larger end, complemented when it runs backwards.
  const IndexLists half = lists_of(mesh.positions.size(), [&](const auto& emit) {
    for (const Triangle& t : mesh.triangles)
      for (std::size_t c = 0; c < 3; ++c) {
        const std::int32_t from = t[c];
        const std::int32_t to = t[(c + 1) % 3];
        if (from < to) emit(from, to);
        if (to < from) emit(to, ~from);
      }
  });

  std::vector<Edge> result;
  result.reserve(half.items.size() / 2 + 1);
  std::vector<std::int32_t> bucket;
  const auto larger_end = [](std::int32_t item) { return item < 0 ? ~item : item; };
  for (std::size_t v = 0; v < half.size(); ++v) {
    bucket.assign(half[v].begin(), half[v].end());
    std::sort(bucket.begin(), bucket.end(), [&](auto p, auto q) { return larger_end(p) < larger_end(q); });
    for (std::size_t i = 0; i < bucket.size(); ++i) {
      if (i == 0 || larger_end(bucket[i]) != larger_end(bucket[i - 1]))
        result.push_back({static_cast<std::int32_t>(v), larger_end(bucket[i]), 0, 0});
      ++(bucket[i] < 0 ? result.back().backward : result.back().forward);
    }
  }
  return result;
}

}  // namespace meniscus::mesh
