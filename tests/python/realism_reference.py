"""A second implementation of the realism score, in NumPy, from only the published definition (docs/explanation/realism.md).

It shares no code and no method with evaluation/realism*. Box distances use Minkowski differences of polygons, edge distances a
search over whole polylines, sides of corners their turning direction, and histograms np.histogram. Scenes come from to_arrays().
"""

import numpy as np

START, STEPS, DT = 10, 80, 0.1
ROUNDING, FAR = 0.7, 1e9
# name: (weight in 2024, weight in 2025, minimum, maximum, bins); events have no bins.
FEATURES = {
    "linear_speed": (0.05, 0.05, 0, 25, 10), "linear_acceleration": (0.05, 0.05, -12, 12, 11),
    "angular_speed": (0.05, 0.05, -0.628, 0.628, 11), "angular_acceleration": (0.05, 0.05, -3.14, 3.14, 11),
    "distance_to_nearest_object": (0.1, 0.1, -5, 40, 10), "collision": (0.25, 0.25, None, None, None),
    "time_to_collision": (0.1, 0.1, 0, 5, 10), "distance_to_road_edge": (0.1, 0.05, -20, 40, 10),
    "off_road": (0.25, 0.25, None, None, None), "red_light": (0, 0.05, None, None, None),
}  # fmt: skip


def cross(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def hull(points):
    """Returns the corners of the convex hull, counter-clockwise (Andrew's monotone chain)."""
    points = points[np.lexsort((points[:, 1], points[:, 0]))]

    def half(ordered):
        chain = []
        for p in ordered:
            while len(chain) > 1 and cross(chain[-1] - chain[-2], p - chain[-2]) <= 1e-12:
                chain.pop()
            chain.append(p)
        return chain[:-1]

    return np.array(half(points) + half(points[::-1]))


def corners(x, y, heading, length, width):
    c, s = np.cos(heading), np.sin(heading)
    local = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * [length / 2, width / 2]
    return local @ np.array([[c, s], [-s, c]]) + [x, y]


def box_distance(a, b):
    """Returns the distance of two rounded boxes (x, y, heading, length, width): the distance of the origin to the Minkowski difference of
    their cores, minus both radii."""
    radii = [ROUNDING * min(box[3:]) / 2 for box in (a, b)]
    cores = [corners(*box[:3], box[3] - 2 * r, box[4] - 2 * r) for box, r in zip((a, b), radii)]
    polygon = hull((cores[0][:, None] - cores[1][None]).reshape(-1, 2))
    begin, way = polygon, np.roll(polygon, -1, 0) - polygon
    t = np.clip(-(begin * way).sum(1) / (way**2).sum(1), 0, 1)
    distance = np.linalg.norm(begin + t[:, None] * way, axis=1).min()
    is_inside = (cross(way, -begin) >= 0).all()
    return (-distance if is_inside else distance) - sum(radii)


class Edges:
    """Road edges as polylines with the road on their left."""

    def __init__(self, edges):
        points, begin = np.asarray(edges["points"], float).reshape(-1, 3), edges["begin"]
        a, b, before, after = [], [], [], []
        for first, end in zip(begin[:-1], begin[1:]):
            line = points[first:end]
            ways = np.diff(line[:, :2], axis=0)
            is_ring = len(line) > 2 and np.linalg.norm(line[-1, :2] - line[0, :2]) <= 1
            a.append(line[:-1]), b.append(line[1:])
            none = np.full((1, 2), np.nan)
            before.append(np.concatenate([ways[-1:] if is_ring else none, ways[:-1]]))
            after.append(np.concatenate([ways[1:], ways[:1] if is_ring else none]))
        self.a, self.b, self.before, self.after = (np.concatenate(x) if x else np.zeros((0, 3)) for x in (a, b, before, after))

    def distances(self, points):
        """Returns the signed horizontal distances [n] of points [n, 3] to the nearest edge, positive off the road. The search for the nearest
    edge multiplies height differences by 3."""
        if not len(self.a):
            return np.full(len(points), -50.0)
        way = (self.b - self.a)[:, :2]
        from_a = points[:, None, :2] - self.a[None, :, :2]
        t = np.clip((from_a * way).sum(-1) / np.maximum((way**2).sum(-1), 1e-12), 0, 1)
        away = from_a - t[..., None] * way
        dz = 3 * (points[:, None, 2] - self.a[:, 2] - t * (self.b - self.a)[:, 2])
        apart = (away**2).sum(-1) + dz**2
        rows, i = np.arange(len(points)), apart.argmin(1)
        t, away, p = t[rows, i], away[rows, i], points[:, :2]
        is_left = cross(way[i], from_a[rows, i]) >= 0
        for ends, neighbors, sign, begin in ((t <= 0, self.before, -1, None), (t >= 1, self.after, 1, self.b)):
            beside = neighbors[i]
            start = self.a[i, :2] - beside if begin is None else begin[i, :2]
            its_left = cross(beside, p - start) >= 0
            # If the two edges of a corner disagree, the road is inside only at a turn to the right.
            decides = ends & ~np.isnan(beside[:, 0]) & (its_left != is_left)
            is_left = np.where(decides, sign * cross(way[i], beside) < 0, is_left)
        distance = np.where(is_left, -1, 1) * np.linalg.norm(away, axis=-1)
        return np.where(apart[rows, i] > 50**2, -50.0, distance)


def centered(values, is_angle=False):
    """Returns central differences over the last axis, NaN at both ends."""
    out = np.full(values.shape, np.nan)
    change = values[..., 2:] - values[..., :-2]
    out[..., 1:-1] = ((change + np.pi) % (2 * np.pi) - np.pi if is_angle else change) / (2 * DT)
    return out


class Reference:
    def __init__(self, scene):
        arrays = scene.to_arrays()
        tracks = arrays["tracks"]
        valid = np.asarray(tracks["valid"], bool)
        there = np.flatnonzero(valid[:, START])
        at_start = scene.starting_at(START)
        named = np.zeros(len(valid), bool)
        if scene.facts["tracks_to_predict"]:
            named |= at_start.mask("tracks_to_predict").astype(bool)
            if scene.sdc_track is not None:
                named |= at_start.mask("self").astype(bool)
        else:
            named[:] = True
        self.ids = np.asarray(tracks["id"])[there]
        self.scored = np.flatnonzero(named[there])
        self.size = np.asarray(tracks["size_m"], float)[there]
        self.is_vehicle = np.asarray(scene.tracks()["type"])[there] == 1
        steps = valid.shape[1]
        self.history = np.full((len(there), START + 1 + STEPS, 4), np.nan)
        count = min(steps, START + 1 + STEPS)
        pose = np.concatenate([tracks["position_m"], np.asarray(tracks["heading_rad"])[..., None]], -1)[there, :count].astype(float)
        pose[..., 2] += self.size[:, None, 2] / 2
        self.history[:, :count] = np.where(valid[there, :count, None], pose, np.nan)
        self.edges = Edges(arrays["edges"])
        self.lights = arrays["lights"]

    def poses(self, rollouts):
        """Returns poses [rollouts, objects, 91, 4]: the recording up to step 10, then the rollouts."""
        order = [list(rollouts.track_ids).index(i) for i in self.ids]
        future = np.concatenate([rollouts.center_m, np.asarray(rollouts.heading_rad)[..., None]], -1).astype(np.float32)[:, order]
        past = np.broadcast_to(self.history[None, :, : START + 1], (len(future), len(self.ids), START + 1, 4))
        return np.concatenate([past, future.astype(float)], 2)

    def features(self, poses):
        """Returns {name: [scored, 80]} from poses [objects, 91, 4]."""
        first = START + 1
        delta = (poses[:, 2:, :3] - poses[:, :-2, :3]) / (2 * DT)
        speed = np.full(poses.shape[:2], np.nan)
        speed[:, 1:-1] = np.linalg.norm(delta, axis=-1)
        turn = centered(poses[..., 3], is_angle=True)
        out = {name: np.full((len(self.scored), STEPS), np.nan) for name in FEATURES}
        for name, values in (("linear_speed", speed), ("linear_acceleration", centered(speed)), ("angular_speed", turn),
                             ("angular_acceleration", centered(turn))):  # fmt: skip
            out[name][:] = values[self.scored, first:]
        for i, me in enumerate(self.scored):
            own, size = poses[me, first:], self.size[me]
            boxes = np.array([corners(*pose[[0, 1, 3]], *size[:2]) for pose in own])
            feet = np.broadcast_to((own[:, 2] - size[2] / 2)[:, None, None], (STEPS, 4, 1))
            edge = self.edges.distances(np.nan_to_num(np.concatenate([boxes, feet], -1).reshape(-1, 3))).reshape(STEPS, 4).max(1)
            for step in range(STEPS):
                at = first + step
                if np.isnan(poses[me, at, 0]):
                    continue
                nearest = self.nearest(poses[:, at], me)
                out["distance_to_nearest_object"][i, step], out["collision"][i, step] = nearest, nearest < 0
                out["distance_to_road_edge"][i, step], out["off_road"][i, step] = edge[step], edge[step] > 0
                if self.is_vehicle[me]:
                    out["time_to_collision"][i, step] = self.time_to_collision(poses[:, at], speed[:, at], me)
                    out["red_light"][i, step] = self.runs_red(poses[me, at - 1 : at + 1], me, at)
        return out

    def nearest(self, now, me):
        reach = np.hypot(*self.size[:, :2].T) / 2
        bound = np.hypot(*(now[:, :2] - now[me, :2]).T) - reach - reach[me]
        bound[me] = np.nan
        best = np.inf
        mine = (*now[me, [0, 1, 3]], *self.size[me, :2])
        for other in np.argsort(bound):
            if not bound[other] < best:
                break
            best = min(best, box_distance(mine, (*now[other, [0, 1, 3]], *self.size[other, :2])))
        return best

    def time_to_collision(self, now, speed, me):
        c, s = np.cos(now[me, 3]), np.sin(now[me, 3])
        gaps = []
        for other in range(len(now)):
            if other == me or np.isnan(now[other, 0]):
                continue
            turned = (now[other, 3] - now[me, 3] + np.pi) % (2 * np.pi) - np.pi
            # The other's corners in the frame of `me`.
            box = (corners(*now[other, [0, 1, 3]], *self.size[other, :2]) - now[me, :2]) @ np.array([[c, -s], [s, c]])
            gap = box[:, 0].min() - self.size[me, 0] / 2
            half = self.size[me, 1] / 2
            middle, reach = (box[:, 1].max() + box[:, 1].min()) / 2, np.ptp(box[:, 1]) / 2
            overlap = half + reach - abs(middle)
            if gap > 0 and overlap > 0 and abs(turned) <= np.radians(10 if overlap < 0.5 else 75):
                gaps.append((gap, other))
        if not gaps:
            return 5.0
        gap, other = min(gaps)
        closing = speed[me] - speed[other]
        return min(gap / closing, 5.0) if closing > 0 else 5.0

    def runs_red(self, pair, me, step):
        states = np.asarray(self.lights["states"]) if self.lights else np.zeros((0, 0))
        if np.isnan(pair).any() or not len(states) or step >= states.shape[1]:
            return False
        front = pair[:, :2] + self.size[me, 0] / 2 * np.stack([np.cos(pair[:, 3]), np.sin(pair[:, 3])], 1)
        crossed = []
        for (left, right), state in zip(np.asarray(self.lights["stop_lines"]), states[:, step]):
            across = right[:2] - left[:2]
            way = np.array([-across[1], across[0]]) / np.linalg.norm(across)  # direction of traffic
            turned = (pair[1, 3] - np.arctan2(way[1], way[0]) + np.pi) % (2 * np.pi) - np.pi
            before, after = (front - left[:2]) @ way
            if state == 0 or abs(turned) > np.pi / 4 or abs(pair[1, 2] - self.size[me, 2] / 2 - left[2]) > 2:
                continue
            if before < 0 <= after:
                at = front[0] + (front[1] - front[0]) * before / (before - after)
                along = (at - left[:2]) @ across / (across @ across)
                if 0 <= along <= 1:
                    crossed.append(state)
        return bool(crossed) and all(state in (1, 4) for state in crossed)  # arrow_stop, stop

    def score(self, rollouts, version="2025"):
        recorded = self.features(self.history)
        poses = self.poses(rollouts)
        simulated = [self.features(each) for each in poses]
        pooled, by_object, rates = {}, {}, {}
        for name, (*weights, low, high, bins) in FEATURES.items():
            logs = []
            for i in range(len(self.scored)):
                mine, theirs = recorded[name][i], np.array([each[name][i] for each in simulated])
                known = ~np.isnan(mine)
                if bins is None:
                    if known.any():
                        count = int((theirs[:, known] > 0).any(1).sum())
                        alike = count if (mine[known] > 0).any() else len(theirs) - count
                        logs.append(np.log([(alike + 0.001) / (len(theirs) + 0.002)]))
                        rates.setdefault(name, []).append(count / len(theirs))
                    continue
                samples = theirs[~np.isnan(theirs)]
                if known.any() and len(samples):
                    counts, edges = np.histogram(np.clip(samples, low, high), bins, (low, high))
                    bin_of = np.minimum(np.searchsorted(edges, np.clip(mine[known], low, high), "right") - 1, bins - 1)
                    logs.append(np.log((counts[bin_of] + 0.1) / (len(samples) + 0.1 * bins)))
            pooled[name] = np.exp(np.concatenate(logs).mean()) if logs else None
            by_object[name] = np.mean([np.exp(each.mean()) for each in logs]) if logs else None
        column = ("2024", "2025").index(version)

        def weighted(likelihoods):
            known = [name for name, value in likelihoods.items() if value is not None]
            weights = np.array([FEATURES[name][column] for name in known])
            return float(weights @ [likelihoods[name] for name in known] / weights.sum())

        apart = np.linalg.norm(poses[:, self.scored, START + 1 :, :3] - self.history[None, self.scored, START + 1 :, :3], axis=-1)
        ade = np.nanmean(np.nanmean(apart, -1), -1)
        return {
            "realism": weighted(pooled), "realism_by_object": weighted(by_object), "likelihoods": pooled, "likelihoods_by_object": by_object,
            "ade_m": ade.mean(), "min_ade_m": ade.min(), "collision_rate": np.mean(rates["collision"]), "off_road_rate": np.mean(rates["off_road"]),
        }  # fmt: skip
