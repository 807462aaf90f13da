"""Compares our features with OpenCV's SIFT on every case of a folder.

    cargo build --release -p benches --bin native-features
    python benches/compare_sift.py DATA_DIR [--ratio R] [--cases NAME …] [OPTION=VALUE …]

Needs numpy and opencv-python-headless (pip); not part of CI. Both sides: the ratio test from the target's side, mutual
nearest neighbours, repeated points dropped. A match is right when
  - the case has a true map: it lies within 3 px of the true place of its target point;
  - it has depth maps only: depth-RANSAC of OpenCV's and our matches together keeps it (x' ~ H x + e d, 3 px);
  - it has neither: the fundamental matrix of OpenCV's and our matches together keeps it (1.5 px).
One geometry for both sides, so that luck in a RANSAC favours neither. Printed are right / all matches.
Plain is our detector at OpenCV's thresholds and with its descriptors, default has RootSIFT and adaptive effort. Times are
processor time: OpenCV's detection + matching on one thread, and all of our runner's, reading the photos included. Last comes
the median error of the right matches where there is a true map.
"""

import argparse
import json
import os
import resource
import subprocess
import time

import cv2
import numpy as np

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
RUNNER = os.path.join(ROOT, "target", "release", "native-features")
# With fewer right matches of OpenCV's a share says nothing.
LEAST = 5
PLAIN = ["adaptive=false", "root=false", "max_keypoints=1000000", "max_size=0"]


class Case:
    """Photos, inverse depth of the target and the true map, where there are any."""

    def __init__(self, folder):
        with open(os.path.join(folder, "case.json")) as file:
            self.json = json.load(file)
        self.files = [os.path.join(folder, self.json[side]) for side in ("target", "reference")]
        self.gray = [cv2.cvtColor(cv2.imread(file), cv2.COLOR_BGR2GRAY) for file in self.files]
        # A tracked sensor's pose is several pixels off: that truth cannot tell right from wrong.
        measured = self.json["name"].startswith("kinect")
        self.truth = None if measured else self.json.get("truth") or self.json.get("truth_map")
        true_depth = os.path.join(folder, "truth_inverse_depth.npy")
        how = self.json["depth"]
        self.depth = None
        if os.path.exists(true_depth):
            self.depth = np.load(true_depth).astype(float)
        elif how:
            raw = cv2.imread(os.path.join(folder, self.json["target_depth"]), cv2.IMREAD_UNCHANGED).astype(float)
            raw = raw if raw.ndim == 2 else raw[..., 0]
            value = np.where(raw == how["invalid"], np.nan, raw * how["scale"])
            self.depth = 1 / np.where(value > 0, value, np.nan) if how["kind"] == "metric" else value


def opencv(case, ratio):
    sift, matcher = cv2.SIFT_create(), cv2.BFMatcher(cv2.NORM_L2)
    start = time.process_time()
    (kt, dt), (kr, dr) = (sift.detectAndCompute(gray, None) for gray in case.gray)
    detected = time.process_time()
    back = [m.trainIdx for m in matcher.match(dr, dt)]
    pairs = [
        (kt[near[0].queryIdx].pt, kr[near[0].trainIdx].pt)
        for near in matcher.knnMatch(dt, dr, k=2)
        if len(near) == 2
        and near[0].distance < ratio * near[1].distance
        and back[near[0].trainIdx] == near[0].queryIdx
    ]
    times = f"{1e3 * (detected - start):.0f}+{1e3 * (time.process_time() - detected):.0f}"
    return [len(kt), len(kr)], times, unique(np.array(pairs, float).reshape(-1, 4))


def ours(case, ratio, settings):
    start = children()
    line = subprocess.run([RUNNER, *case.files, f"ratio={ratio}", *settings], check=True, capture_output=True).stdout
    result = json.loads(line)
    return result["keypoints"], f"{1e3 * (children() - start):.0f}", unique(np.array(result["matches"], float).reshape(-1, 4))


def children():
    """Processor time of all programs run so far, in seconds."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def unique(matches):
    """Drops all but the first match of a point, as the fit does."""
    for side in (slice(0, 2), slice(2, 4)):
        _, first = np.unique(np.round(matches[:, side], 3), axis=0, return_index=True)
        matches = matches[np.sort(first)]
    return matches


def sample(depth, points):
    """Inverse depth at the nearest pixel."""
    h, w = depth.shape
    x, y = (np.clip(np.rint(points[:, i]).astype(int), 0, size - 1) for i, size in ((0, w), (1, h)))
    return depth[y, x]


def project(matrix, points, depth):
    image = np.c_[points, np.ones(len(points)), depth] @ matrix.T
    return np.where(image[:, 2:] > 0, image[:, :2] / image[:, 2:], np.inf)


def true_map_errors(case, matches):
    matrix = np.c_[np.reshape(case.truth["H_inf"], (3, 3)), np.ravel(case.truth["e_prime"])]
    return np.linalg.norm(project(matrix, matches[:, :2], sample(case.depth, matches[:, :2])) - matches[:, 2:], axis=1)


def fit_depth(p, q, d):
    """Least squares for x' ~ H x + e d, signed to be in front of the camera."""
    source = np.c_[p, np.ones(len(p)), d]
    zero = np.zeros_like(source)
    a = np.r_[
        np.c_[source, zero, -q[:, :1] * source],
        np.c_[zero, source, -q[:, 1:] * source],
    ]
    matrix = np.linalg.svd(a)[2][-1].reshape(3, 4)
    return matrix * np.sign(np.median(source @ matrix[2]))


def depth_ransac(case, matches, threshold=3.0, trials=4000):
    """Flags of the matches that the best x' ~ H x + e d keeps. At a hole of the depth map none is kept."""
    known = np.isfinite(sample(case.depth, matches[:, :2]))
    flags = np.zeros(len(matches), bool)
    matches = matches[known]
    p, q, d = matches[:, :2], matches[:, 2:], sample(case.depth, matches[:, :2])
    # Similar magnitudes condition the system.
    scale = 1e3
    d = d / d.mean()
    errors = lambda m: np.linalg.norm(project(m, p / scale, d) * scale - q, axis=1)
    random = np.random.default_rng(0)
    best = np.zeros(len(p), bool)
    score = 0
    for _ in range(trials):
        pick = random.choice(len(p), 6, replace=False)
        r = errors(fit_depth(p[pick] / scale, q[pick] / scale, d[pick]))
        kept = r < threshold
        gain = (1 - (r[kept] / threshold) ** 2).sum()
        if gain > score:
            best, score = kept, gain
    for _ in range(5):
        best = errors(fit_depth(p[best] / scale, q[best] / scale, d[best])) < threshold
    flags[known] = best
    return flags


def verdicts(case, sets):
    """For each set of matches the flags of the right ones, and their errors if there is a true map."""
    if case.truth:
        errors = [true_map_errors(case, m) for m in sets]
        return [e < 3 for e in errors], errors
    together = np.concatenate(sets)
    if case.depth is not None:
        flags = depth_ransac(case, together)
    else:
        cv2.setRNGSeed(1)
        flags = (
            cv2.findFundamentalMat(together[:, :2], together[:, 2:], cv2.USAC_MAGSAC, 1.5, 0.9999, 20000)[1].ravel() > 0
        )
    return np.split(flags, np.cumsum([len(m) for m in sets])[:-1]), None


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("data")
    parser.add_argument("--ratio", type=float, default=0.75)
    parser.add_argument("--cases", nargs="*")
    parser.add_argument("settings", nargs="*")
    args = parser.parse_intermixed_args()
    cv2.setNumThreads(1)
    names = args.cases or sorted(os.listdir(args.data))
    head = ("case", "OpenCV", "plain", "default", "keypoints OpenCV / plain / default", "ms OpenCV / ours", "error in px")
    print("{:28} {:>11} {:>11}        {:>11}        {:>42} {:>18} {}".format(*head))
    shares, precisions = [], []
    for name in names:
        case = Case(os.path.join(args.data, name))
        runs = [
            opencv(case, args.ratio),
            ours(case, args.ratio, PLAIN + args.settings),
            ours(case, args.ratio, args.settings),
        ]
        sets = [run[2] for run in runs]
        flags, errors = verdicts(case, sets)
        right, total = [int(f.sum()) for f in flags], [len(m) for m in sets]
        share = [r / max(right[0], 1) for r in right]
        if right[0] >= LEAST:
            shares.append(share[1:])
        precisions.append([r / max(t, 1) for r, t in zip(right, total)])
        cells = [f"{r:5}/{t:5}" for r, t in zip(right, total)]
        keypoints = " / ".join(f"{a} {b}" for a, b in (run[0] for run in runs))
        times = f"{runs[0][1]} / {runs[2][1]}"
        middle = " / ".join(f"{np.median(e[f]):.2f}" if f.any() else "-" for e, f in zip(errors, flags)) if errors else ""
        print(
            f"{name:28} {cells[0]} {cells[1]} {share[1]:6.1%} {cells[2]} {share[2]:6.1%} {keypoints:>42} {times:>18} {middle}",
            flush=True,
        )
    mean = np.mean(shares, 0), np.min(shares, 0)
    precision = np.mean(precisions, 0)
    print(f"mean share plain {mean[0][0]:.1%}, default {mean[0][1]:.1%}; least {mean[1][0]:.1%}, {mean[1][1]:.1%}")
    print("mean precision OpenCV {:.1%}, plain {:.1%}, default {:.1%}".format(*precision))


if __name__ == "__main__":
    main()
