"""Surfaces of facets that face each other, for scripts/convert: what of a skin faces another surface, and the nearest points of facets."""
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


def distance(p, low, high):
    """That of a point from a box."""
    return math.dist(p, (min(max(p[0], low[0]), high[0]), min(max(p[1], low[1]), high[1]), min(max(p[2], low[2]), high[2])))


def least(n, low, high):
    """The least product of a vector with those of a box."""
    return min(n[0] * low[0], n[0] * high[0]) + min(n[1] * low[1], n[1] * high[1]) + min(n[2] * low[2], n[2] * high[2])


class Facet:
    """A facet: its number and nodes, the points around it, its normal out of the cell, its size and its triangles. In 2D it is as high as it is long."""

    def __init__(self, number, nodes, places, within, dim):
        ring, corners = [places[n] for n in nodes], {2: 2}.get(dim, 3 if len(nodes) in (3, 6) else 4)
        middle = ring[corners:2 * corners] if dim == 3 else ring[2:3]
        around = [p for pair in zip(ring, middle) for p in pair] + ring[len(middle):corners] if middle else ring[:corners]  # with middle nodes between the corners
        self.number, self.nodes, self.centre = number, nodes, mean(ring[:corners])
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
    """Facets of cells (cell, side, nodes) of a mesh, in a tree of boxes in which nearest points are found."""

    def __init__(self, m, sides, dim):
        self.facets = [Facet(k, nodes, m.nodes, mean([m.nodes[n] for n in m.cells[cell][1]]), dim) for k, (cell, _, nodes) in enumerate(sides)]
        self.root = None

    def box(self, facets):
        """(low, high, least and greatest normals, facets or none, two boxes)"""
        points = [p for f in facets for t in f.triangles for p in t]
        low, high, least_normal, normal = ([pick(c) for c in zip(*of)] for of in (points, [f.normal for f in facets]) for pick in (min, max))
        if len(facets) <= 4:
            return low, high, least_normal, normal, facets, None
        axis = max(range(3), key=lambda c: high[c] - low[c])
        facets = sorted(facets, key=lambda f: f.centre[axis])
        return low, high, least_normal, normal, None, (self.box(facets[:len(facets) // 2]), self.box(facets[len(facets) // 2:]))

    def nearest(self, p, seen=None, limit=math.inf):
        """The nearest point, nearer than the limit: (distance, point, facet), or None; of the facets opposite to `seen` alone, and not far behind it."""
        self.root = self.root or self.box(self.facets)
        best, stack = (limit, None, None), [self.root]
        while stack:
            low, high, first, last, facets, boxes = stack.pop()
            if distance(p, low, high) > best[0] or seen and (least(seen.normal, first, last) >= OPPOSITE or -least(minus((0, 0, 0), seen.normal), low, high) - dot(seen.normal, p) < -0.5 * seen.size):
                continue
            if boxes:
                stack += sorted(boxes, key=lambda box: distance(p, box[0], box[1]), reverse=True)
            for facet in facets or ():
                if math.dist(p, facet.centre) - facet.size < best[0] and (seen is None or dot(facet.normal, seen.normal) < OPPOSITE):
                    for triangle in facet.triangles:
                        q = closest(p, *triangle)
                        if math.dist(p, q) < best[0]:
                            best = (math.dist(p, q), q, facet)
        return best if best[1] else None

    def ahead(self, p, facet, limit=math.inf):
        """The nearest facet that is opposite to another one at p and lies ahead of it, not aside: (distance along the normal, facet)."""
        far, q, hit = self.nearest(p, facet, limit) or (0, p, None)
        way = dot(minus(q, p), facet.normal)
        straight = hit and (abs(way) > -OPPOSITE * far or far < 0.1 * facet.size) and way > -0.5 * min(facet.size, hit.size)
        return (way, hit) if straight else (math.inf, None)

    def facing(self, other):
        """The numbers of the facets that face another surface: seen from a point of theirs or of the other's facets, and not behind a facet of the same surface."""
        found = set()
        for mine, its, back in ((self, other, False), (other, self, True)):
            for facet in mine.facets:
                for p in facet.samples[:1 if back else None]:
                    way, hit = its.ahead(p, facet)
                    if hit and not (way > 1e-6 * facet.size and 0 < mine.ahead(p, facet, way)[0] < way):
                        found.add(hit.number if back else facet.number)
                        if not back:
                            break
        return sorted(found)

    def turns(self):
        """Whether the surface goes round an edge of more than 40 degrees, or is as curved."""
        return any(dot(f.normal, self.facets[0].normal) < 0.766 for f in self.facets)


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
