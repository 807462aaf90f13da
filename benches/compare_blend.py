"""Compares our composition with OpenCV's on the same warped pictures and masks.

    cargo run --release -p benches --bin blend-case -- OUT RUNS CASE... > OUT/ours.jsonl
    python3 benches/compare_blend.py OUT OUT/ours.jsonl

Needs numpy and opencv-python-headless. OpenCV's chain is that of its Stitcher: block gains, graph cut (colour and gradient) on the
adjusted pictures, multi-band blending with its usual number of bands; pinned to one thread, as we have one. Its
seam is found at full resolution, like ours; `--seam-megapixels 0.1` is the Stitcher's own default, with its
dilation of the enlarged masks.

Both measures are taken at each side's own seam, against each side's own adjusted sources, over luminance 0 to 255:

gradient  Mean of |d mosaic - d source| over the horizontal and vertical steps between neighbours within 4 pixels of the seam,
          where the source is the photo that shows on both sides of the step. For a step across the seam it is the mean of
          the photos that are valid on both sides.
step      How much brighter the mosaic gets from one side of the seam to the other (means of 4 pixels each, across
          it) than the photos that are valid on all 8 say, averaged over 17x17 pixels along the seam before the
          absolute value is taken: noise and single edges are no steps.
"""

import argparse
import json
import sys
import time

import cv2
import numpy as np

NEAR = 4
ALONG = 17


def luminance(image):
    return image[..., :3].astype(np.float64) @ np.array([0.114, 0.587, 0.299])


def opencv(target, mask, reference, offset, seam_megapixels):
    """Mosaic, labels (1 target, 2 reference) and adjusted sources on the canvas, and milliseconds."""
    corners = [(0, 0), offset]
    masks = [mask, np.full(reference.shape[:2], 255, np.uint8)]
    start = time.process_time()
    images = [target.copy(), reference.copy()]
    compensator = cv2.detail.BlocksGainCompensator()
    compensator.feed(corners, images, masks)
    images = [compensator.apply(i, corners[i], image, masks[i]) for i, image in enumerate(images)]
    scale = 1.0
    if seam_megapixels:
        scale = min(1.0, (seam_megapixels * 1e6 / (reference.shape[0] * reference.shape[1])) ** 0.5)
    finder = cv2.detail.GraphCutSeamFinder("COST_COLOR_GRAD")
    if scale < 1.0:
        small = [cv2.resize(i, None, fx=scale, fy=scale, interpolation=cv2.INTER_LINEAR_EXACT) for i in images]
        small_masks = [
            cv2.resize(m, s.shape[1::-1], interpolation=cv2.INTER_NEAREST) for m, s in zip(masks, small)
        ]
        small_corners = [(round(x * scale), round(y * scale)) for x, y in corners]
        found = finder.find([s.astype(np.float32) for s in small], small_corners, small_masks)
        seams = [
            cv2.resize(cv2.dilate(getattr(f, "get", lambda f=f: f)(), None), m.shape[::-1],
                       interpolation=cv2.INTER_LINEAR_EXACT) & m
            for f, m in zip(found, masks)
        ]
    else:
        found = finder.find([i.astype(np.float32) for i in images], corners, [m.copy() for m in masks])
        seams = [getattr(f, "get", lambda f=f: f)() for f in found]
    blender = cv2.detail.MultiBandBlender()
    height, width = mask.shape
    blender.setNumBands(max(1, int(np.ceil(np.log2(np.sqrt(width * height) * 0.05)) - 1)))
    blender.prepare((0, 0, width, height))
    for image, seam, corner in zip(images, seams, corners):
        blender.feed(image.astype(np.int16), seam, corner)
    mosaic, _ = blender.blend(None, None)
    mosaic = np.clip(mosaic, 0, 255).astype(np.uint8)
    elapsed = 1e3 * (time.process_time() - start)
    placed, own = on_canvas(images[1], offset, mask.shape)
    labels = np.where(own > 0, 2, np.where(mask > 0, 1, 0)).astype(np.uint8)
    shown = on_canvas(seams[1][..., None], offset, mask.shape)[0][..., 0] > 0
    labels[(mask > 0) & ~shown & (seams[0] > 0)] = 1
    return mosaic, labels, images[0], placed, elapsed


def on_canvas(image, offset, shape):
    canvas = np.zeros((*shape, image.shape[2]), image.dtype)
    valid = np.zeros(shape, np.uint8)
    x, y = offset
    canvas[y : y + image.shape[0], x : x + image.shape[1]] = image
    valid[y : y + image.shape[0], x : x + image.shape[1]] = 255
    return canvas, valid


def measures(mosaic, labels, sources, valid):
    """Gradient error and brightness step, and how many pixels the seam is long."""
    total = np.zeros(2)
    steps = np.zeros(labels.shape)
    weight = np.zeros(labels.shape)
    for axis in (0, 1):
        turn = (lambda a: a.T) if axis else (lambda a: a)
        m, shown = turn(mosaic), turn(labels)
        s, v = [turn(a) for a in sources], [turn(a) for a in valid]
        across = (shown[:-1] ^ shown[1:]) == 3  # 1 and 2
        near = cv2.dilate(turn(seam(labels)).astype(np.uint8), np.ones((2 * NEAR + 1,) * 2)) > 0
        both = [a[:-1] & a[1:] for a in v]
        count = np.zeros(across.shape)
        expected = np.zeros(across.shape)
        for k in (0, 1):
            use = both[k] & (across | ((shown[:-1] == k + 1) & (shown[1:] == k + 1)))
            expected += use * (s[k][1:] - s[k][:-1])
            count += use
        use = (count > 0) & near[:-1] & near[1:]
        error = np.abs(m[1:] - m[:-1] - expected / np.maximum(count, 1))
        total += (error[use].sum(), use.sum())
        side = np.array([1.0] * NEAR) / NEAR
        rise = lambda a: after(a, side) - before(a, side)
        count = np.zeros(across.shape)
        expected = np.zeros(across.shape)
        for k in (0, 1):
            use = (before(v[k].astype(float), side) > 0.999) & (after(v[k].astype(float), side) > 0.999)
            expected += use * rise(s[k])
            count += use
        known = v[0] | v[1]
        use = across & (count > 0) & (before(known * 1.0, side) > 0.999) & (after(known * 1.0, side) > 0.999)
        sign = np.where(shown[:-1] == 1, 1.0, -1.0)
        turn(steps)[:-1][use] += (sign * (rise(m) - expected / np.maximum(count, 1)))[use]
        turn(weight)[:-1][use] += 1
    blur = lambda a: cv2.boxFilter(a, -1, (ALONG, ALONG), normalize=False, borderType=cv2.BORDER_CONSTANT)
    mean = np.abs(blur(steps)) / np.maximum(blur(weight), 1)
    return total[0] / max(total[1], 1), (mean * weight).sum() / max(weight.sum(), 1), int(weight.sum())


def seam(labels):
    edge = np.zeros(labels.shape, bool)
    edge[:-1] |= (labels[:-1] ^ labels[1:]) == 3
    edge[1:] |= (labels[:-1] ^ labels[1:]) == 3
    edge[:, :-1] |= (labels[:, :-1] ^ labels[:, 1:]) == 3
    edge[:, 1:] |= (labels[:, :-1] ^ labels[:, 1:]) == 3
    return edge


def before(a, side):
    """Weighted mean of the rows up to and including y, for every y but the last."""
    padded = np.pad(a, ((len(side) - 1, 0), (0, 0)))
    return sum(w * padded[len(side) - 1 - i : padded.shape[0] - i - 1] for i, w in enumerate(side))


def after(a, side):
    """Weighted mean of the rows from y + 1 on, for every y but the last."""
    padded = np.pad(a, ((0, len(side) - 1), (0, 0)))
    return sum(w * padded[1 + i : padded.shape[0] - len(side) + 1 + i] for i, w in enumerate(side))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder")
    parser.add_argument("ours")
    parser.add_argument("--seam-megapixels", type=float, default=0.0)
    parser.add_argument("--runs", type=int, default=1)
    parser.add_argument("--write", action="store_true", help="write OpenCV's mosaics, too")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    print(f"{'case':28}{'gradient':>9}{'OpenCV':>8}{'step':>8}{'OpenCV':>8}{'ms':>8}{'OpenCV':>8}{'seam':>7}{'OpenCV':>8}")
    won = np.zeros(4, int)
    rows = [json.loads(line) for line in open(options.ours)]
    for row in rows:
        read = lambda what: cv2.imread(f"{options.folder}/{row['case']}_{what}.png", cv2.IMREAD_UNCHANGED)
        warped, reference, adjusted = read("warped"), read("reference")[..., :3].copy(), read("adjusted")
        mask, offset = warped[..., 3].copy(), tuple(row["offset"])
        target = warped[..., :3].copy()
        placed, own = on_canvas(reference, offset, mask.shape)
        valid = [mask > 0, own > 0]
        ours = measures(
            luminance(read("mosaic")), read("seam"), [luminance(adjusted), luminance(placed)], valid
        )
        best = None
        for _ in range(options.runs):
            result = opencv(target, mask, reference, offset, options.seam_megapixels)
            best = min(best or np.inf, result[-1])
        mosaic, labels, *sources = result[:-1]
        theirs = measures(luminance(mosaic), labels, [luminance(s) for s in sources], valid)
        if options.write:
            cv2.imwrite(f"{options.folder}/{row['case']}_opencv.png", mosaic)
        better = [ours[0] < theirs[0], ours[1] < theirs[1], row["ms"] <= 1.5 * best]
        won += [*better, all(better[:2])]
        print(
            f"{row['case']:28}{ours[0]:9.2f}{theirs[0]:8.2f}{ours[1]:8.2f}{theirs[1]:8.2f}"
            f"{row['ms']:8.0f}{best:8.0f}{ours[2]:7}{theirs[2]:8}"
        )
    print(f"of {len(rows)}: lower gradient error {won[0]}, lower step {won[1]}, both {won[3]}, at most 1.5 x the time {won[2]}")


if __name__ == "__main__":
    sys.exit(main())
