// SPDX-License-Identifier: GPL-2.0-or-later

#include "motion/shape.hh"

#include "geometry/trigonometry.hh"

namespace Stg::motion {
namespace {

using Indices = std::vector<uint32_t>;

double Area2(Vector a, Vector b, Vector c) { return Cross(b - a, c - a); }

double SignedArea(std::span<const Vector> polygon) {
  double area = 0.0;
  for (size_t i = 0; i < polygon.size(); i++)
    area += Cross(polygon[i], polygon[i + 1 == polygon.size() ? 0 : i + 1]);
  return 0.5 * area;
}

/// The corners without those that repeat their predecessor or lie on the line between neighbours.
std::vector<Vector> WithoutFlatCorners(std::span<const Vector> polygon) {
  std::vector<Vector> kept(polygon.begin(), polygon.end());
  for (bool changed = true; changed && kept.size() > 2;) {
    changed = false;
    for (size_t i = 0; i < kept.size() && kept.size() > 2; i++) {
      const Vector a = kept[i == 0 ? kept.size() - 1 : i - 1], b = kept[i];
      const Vector c = kept[i + 1 == kept.size() ? 0 : i + 1];
      const double scale = Length(b - a) * Length(c - b);
      const double twist = Area2(a, b, c);
      if (twist > 1e-12 * scale || -twist > 1e-12 * scale) continue;
      kept.erase(kept.begin() + static_cast<std::ptrdiff_t>(i));
      changed = true;
      break;
    }
  }
  return kept;
}

bool Contains(Vector a, Vector b, Vector c, Vector p) {
  return Area2(a, b, p) >= 0.0 && Area2(b, c, p) >= 0.0 && Area2(c, a, p) >= 0.0;
}

bool Equal(Vector a, Vector b) { return a.x == b.x && a.y == b.y; }

bool IsEar(const std::vector<Vector>& corners, const Indices& ring, size_t at) {
  const size_t n = ring.size();
  const Vector a = corners[ring[(at + n - 1) % n]], b = corners[ring[at]];
  const Vector c = corners[ring[(at + 1) % n]];
  if (Area2(a, b, c) <= 0.0) return false;
  for (const uint32_t other : ring) {
    const Vector p = corners[other];
    if (Equal(p, a) || Equal(p, b) || Equal(p, c)) continue;
    if (Contains(a, b, c, p)) return false;
  }
  return true;
}

/// Cuts off one ear after the other. False if a polygon that is left has none.
bool Triangulate(const std::vector<Vector>& corners, std::vector<Indices>* parts) {
  Indices ring(corners.size());
  for (size_t i = 0; i < ring.size(); i++) ring[i] = static_cast<uint32_t>(i);
  while (ring.size() > 3) {
    size_t ear = 0;
    while (ear < ring.size() && !IsEar(corners, ring, ear)) ear++;
    if (ear == ring.size()) return false;
    const size_t n = ring.size();
    parts->push_back({ring[(ear + n - 1) % n], ring[ear], ring[(ear + 1) % n]});
    ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  parts->push_back(ring);
  return Area2(corners[ring[0]], corners[ring[1]], corners[ring[2]]) > 0.0;
}

bool IsConvex(const std::vector<Vector>& corners, const Indices& part) {
  const size_t n = part.size();
  for (size_t i = 0; i < n; i++)
    if (Area2(corners[part[i]], corners[part[(i + 1) % n]], corners[part[(i + 2) % n]]) < 0.0)
      return false;
  return true;
}

/// Joins two parts at a common edge. Empty if they have none or the result is not convex.
Indices Joined(const std::vector<Vector>& corners, const Indices& a, const Indices& b) {
  for (size_t i = 0; i < a.size(); i++)
    for (size_t k = 0; k < b.size(); k++) {
      if (a[i] != b[(k + 1) % b.size()] || a[(i + 1) % a.size()] != b[k]) continue;
      Indices all;
      for (size_t m = 0; m < a.size(); m++) all.push_back(a[(i + 1 + m) % a.size()]);
      for (size_t m = 2; m < b.size(); m++) all.push_back(b[(k + m) % b.size()]);
      return IsConvex(corners, all) ? all : Indices();
    }
  return {};
}

/// Joins parts while the results are convex (Hertel and Mehlhorn, 1983).
void JoinParts(const std::vector<Vector>& corners, std::vector<Indices>* parts) {
  for (size_t i = 0; i < parts->size(); i++)
    for (size_t k = i + 1; k < parts->size();) {
      Indices all = Joined(corners, (*parts)[i], (*parts)[k]);
      if (all.empty()) {
        k++;
        continue;
      }
      (*parts)[i] = std::move(all);
      parts->erase(parts->begin() + static_cast<std::ptrdiff_t>(k));
      k = i + 1;
    }
}

/// Integrals over a triangle, of one and of the distance from the origin. The latter by the centres
/// of smaller triangles, since its closed form needs a logarithm.
void Integrate(Vector a, Vector b, Vector c, int depth, double* area, double* moment) {
  if (depth == 0) {
    const double part = 0.5 * Area2(a, b, c);
    *area += part;
    *moment += part * Length((1.0 / 3.0) * (a + b + c));
    return;
  }
  const Vector ab = 0.5 * (a + b), bc = 0.5 * (b + c), ca = 0.5 * (c + a);
  Integrate(a, ab, ca, depth - 1, area, moment);
  Integrate(ab, b, bc, depth - 1, area, moment);
  Integrate(ca, bc, c, depth - 1, area, moment);
  Integrate(ab, bc, ca, depth - 1, area, moment);
}

void IntegratePiece(const Piece& piece, const std::vector<Vector>& corners, double* area,
                    double* moment) {
  constexpr int kDepth = 5, kSectorDepth = 2, kSectors = 32;
  const Vector* corner = &corners[piece.first_corner];
  for (uint32_t i = 2; i < piece.corner_count; i++)
    Integrate(corner[0], corner[i - 1], corner[i], kDepth, area, moment);
  if (piece.radius == 0.0) return;
  if (piece.core == 0.0) {  // a disc about the origin
    const double disc = M_PI * piece.radius * piece.radius;
    *area += disc;
    *moment += disc * (2.0 / 3.0) * piece.radius;
    return;
  }
  for (int i = 0; i < kSectors; i++) {
    const SineCosine from = SinCos(i * (2.0 * M_PI / kSectors));
    const SineCosine to = SinCos((i + 1) * (2.0 * M_PI / kSectors));
    Integrate(corner[0], corner[0] + piece.radius * Vector{from.cosine, from.sine},
              corner[0] + piece.radius * Vector{to.cosine, to.sine}, kSectorDepth, area, moment);
  }
}

}  // namespace

bool CutConvex(std::span<const Vector> polygon, ConvexParts* parts) {
  std::vector<Vector> corners = WithoutFlatCorners(polygon);
  const double area = corners.size() > 2 ? SignedArea(corners) : 0.0;
  if (area == 0.0) return false;
  if (area < 0.0) corners = std::vector<Vector>(corners.rbegin(), corners.rend());
  std::vector<Indices> pieces;
  if (!Triangulate(corners, &pieces)) return false;
  JoinParts(corners, &pieces);
  for (const Indices& piece : pieces) {
    parts->sizes.push_back(static_cast<uint32_t>(piece.size()));
    for (const uint32_t i : piece) parts->corners.push_back(corners[i]);
  }
  return true;
}

void Shapes::AddPiece(std::span<const Vector> piece_corners, double radius, Interval height) {
  double core = 0.0;
  for (const Vector& corner : piece_corners) core = Most(core, Length(corner));
  pieces.push_back({static_cast<uint32_t>(corners.size()),
                    static_cast<uint32_t>(piece_corners.size()), radius, core, height});
  corners.insert(corners.end(), piece_corners.begin(), piece_corners.end());
}

/// Adds the edges of a polygon, or its only point.
void Shapes::AddEdges(const Polygon& polygon) {
  const std::span<const Vector> ring = polygon.corners;
  const size_t before = pieces.size();
  for (size_t i = 0; i < ring.size(); i++) {
    const Vector ends[] = {ring[i], ring[i + 1 == ring.size() ? 0 : i + 1]};
    if (!Equal(ends[0], ends[1])) AddPiece(ends, 0.0, polygon.height);
  }
  if (pieces.size() == before && !ring.empty()) AddPiece(ring.first(1), 0.0, polygon.height);
}

void Shapes::PlaceCorners(const Shape& shape, Vector position, double heading, Vector* to) const {
  if (shape.piece_count == 0) return;
  const Vector* local = &corners[pieces[shape.first_piece].first_corner];
  const SineCosine turn = SinCos(heading);
  for (uint32_t i = 0; i < shape.corner_count; i++)
    to[i] = position + Rotate(local[i], turn.sine, turn.cosine);
}

uint32_t Shapes::Add(std::span<const Polygon> polygons, std::span<const Disc> discs) {
  const size_t first_piece = pieces.size(), first_corner = corners.size();
  for (const Polygon& polygon : polygons) {
    ConvexParts parts;
    if (CutConvex(polygon.corners, &parts)) {
      std::span<const Vector> rest = parts.corners;
      for (const uint32_t size : parts.sizes) {
        AddPiece(rest.first(size), 0.0, polygon.height);
        rest = rest.subspan(size);
      }
      continue;
    }
    AddEdges(polygon);
  }
  for (const Disc& disc : discs) AddPiece({&disc.center, 1}, disc.radius, disc.height);

  Shape shape{static_cast<uint32_t>(first_piece),
              static_cast<uint32_t>(pieces.size() - first_piece),
              static_cast<uint32_t>(corners.size() - first_corner),
              0.0,
              0.0,
              0.0};
  double area = 0.0, moment = 0.0;
  for (size_t i = first_piece; i < pieces.size(); i++) {
    shape.core = Most(shape.core, pieces[i].core);
    shape.bound = Most(shape.bound, pieces[i].core + pieces[i].radius);
    IntegratePiece(pieces[i], corners, &area, &moment);
  }
  shape.arm = area > 0.0 ? moment / area : 0.5 * shape.bound;
  shapes.push_back(shape);
  return static_cast<uint32_t>(shapes.size() - 1);
}

}  // namespace Stg::motion
