"""Surfaces of facets that face each other, for scripts/convert: what of a skin faces another surface, and the nearest points of facets."""
import bisect
import math

OPPOSITE = -0.3  # the cosine between the normals of facets that face each other: 72 degrees, as in surface and mortar


def minus(a, b):
    return [p - q for p, q in zip(a, b)]


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def mean(points):
    return [sum(c) / len(points) for c in zip(*points)]


def unit(a):
    size = math.sqrt(dot(a, a)) or 1.0
    return [c / size for c in a]


def closest(p, a, b, c):
    """The point of a triangle that is nearest to p: its foot in the plane, else that on an edge."""
    n = cross(minus(b, a), minus(c, a))
    size = dot(n, n)
    if size > 0:
        foot = [x - dot(minus(p, a), n) / size * k for x, k in zip(p, n)]
        if all(dot(cross(minus(v, u), minus(foot, u)), n) >= 0 for u, v in ((a, b), (b, c), (c, a))):
            return foot
    feet = []
    for u, v in ((a, b), (b, c), (c, a)):
        along = minus(v, u)
        t = min(max(dot(minus(p, u), along) / (dot(along, along) or 1.0), 0), 1)
        feet.append([x + t * k for x, k in zip(u, along)])
    return min(feet, key=lambda foot: math.dist(foot, p))


class Facet:
    """A facet: its nodes, its points around it, its normal out of the cell, its size and its triangles. In 2D it is as high as it is long."""

    def __init__(self, nodes, places, within, dim):
        ring, corners = [places[n] for n in nodes], {2: 2}.get(dim, 3 if len(nodes) in (3, 6) else 4)
        middle = ring[corners:2 * corners] if dim == 3 else ring[2:3]
        around = [p for pair in zip(ring, middle) for p in pair] + ring[len(middle):corners] if middle else ring[:corners]  # with middle nodes between the corners
        self.nodes, self.centre = nodes, mean(ring[:corners])
        self.size = max(math.dist(p, q) for p in around for q in around)
        if dim == 2:
            low, high = ([[x, y, s * self.size / 2] for x, y, _ in around] for s in (-1, 1))
            self.triangles = [t for k in range(len(around) - 1) for t in ((low[k], low[k + 1], high[k]), (high[k], low[k + 1], high[k + 1]))]
        else:
            self.triangles = [(self.centre, p, q) for p, q in zip(around, around[1:] + around[:1])] if middle or corners == 4 else [tuple(ring[:3])]
        a, b, c = self.triangles[0] if dim == 2 else (ring[0], ring[1], ring[2 if corners == 3 else 3])
        normal = unit(cross(minus(b, a), minus(c, a)))
        self.normal = normal if dot(normal, minus(self.centre, within)) > 0 else [-x for x in normal]
        self.samples = [self.centre, *([0.99 * p + 0.01 * q for p, q in zip(corner, self.centre)] for corner in ring[:corners])]


class Surface:
    """Facets of cells (cell, side, nodes) of a mesh, in which nearest points are found."""

    def __init__(self, m, sides, dim):
        self.facets = [Facet(nodes, m.nodes, mean([m.nodes[n] for n in m.cells[cell][1]]), dim) for cell, _, nodes in sides]
        spread = [max(c) - min(c) for c in zip(*(f.centre for f in self.facets))]
        self.axis, self.lists = spread.index(max(spread)), {}

    def towards(self, normal):
        """The triangles whose normals are opposite to one, or all, along the axis: [(place, centre, radius, triangle, facet)], and the largest radius."""
        key = normal and tuple(round(c, 1) for c in normal)
        if key not in self.lists:
            found = []
            for facet in self.facets:
                if key is None or dot(facet.normal, normal) < OPPOSITE:
                    for triangle in facet.triangles:
                        centre = mean(triangle)
                        found.append((centre[self.axis], centre, max(math.dist(centre, p) for p in triangle), triangle, facet))
            found.sort(key=lambda t: t[0])
            self.lists[key] = ([t[0] for t in found], found, max((t[2] for t in found), default=0.0))
        return self.lists[key]

    def nearest(self, p, normal=None):
        """The nearest point of the facets (that are opposite to a normal): (distance, point, facet); None if there is none."""
        places, found, largest = self.towards(normal)
        start, best = bisect.bisect(places, p[self.axis]), (math.inf, None, None)
        for way in (range(start, len(found)), range(start - 1, -1, -1)):
            for k in way:
                place, centre, radius, triangle, facet = found[k]
                if abs(place - p[self.axis]) - largest >= best[0]:
                    break
                if math.dist(p, centre) - radius < best[0]:
                    q = closest(p, *triangle)
                    best = min(best, (math.dist(p, q), q, facet), key=lambda b: b[0])
        return best if best[1] else None

    def ahead(self, p, facet):
        """The nearest facet that is opposite to another one at p and lies ahead of it, not aside: (distance along the normal, facet)."""
        far, q, hit = self.nearest(p, facet.normal) or (0, p, None)
        way = dot(minus(q, p), facet.normal)
        straight = hit and (abs(way) > -OPPOSITE * far or far < 0.1 * facet.size) and way > -0.5 * min(facet.size, hit.size)
        return (way, hit) if straight else (math.inf, None)

    def facing(self, other):
        """The numbers of the facets that face another surface: seen from a point of theirs or of the other's facets, and not behind a facet of the same surface."""
        found = set()
        for mine, its, back in ((self, other, False), (other, self, True)):
            for k, facet in enumerate(mine.facets):
                for p in facet.samples:
                    way, hit = its.ahead(p, facet)
                    if hit and not 0 < mine.ahead(p, facet)[0] < way:
                        found.add(self.facets.index(hit) if back else k)
        return sorted(found)

    def turns(self):
        """Whether the surface goes round an edge of more than 40 degrees, or is as curved."""
        kinds = {tuple(round(c, 2) for c in f.normal): f.normal for f in self.facets}
        return any(dot(a, b) < 0.766 for a in kinds.values() for b in kinds.values())


def adjusted(m, slave, master, wanted):
    """Moves slave nodes onto the master along its normal, as *CONTACT PAIR, ADJUST does: those that wanted(node, clearance) accepts and that have a foot on a facet. Their number."""
    moved = 0
    for n in slave:
        found = master.nearest(m.nodes[n])
        if found:
            far, q, facet = found
            clearance = dot(minus(m.nodes[n], q), facet.normal)
            if abs(clearance) > 0.999 * far and wanted(n, clearance):
                moved += far > 1e-9 * facet.size
                m.nodes[n] = list(q)
    return moved
