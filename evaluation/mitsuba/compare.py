#!/usr/bin/env python3
"""Turns scenes into two path-traced pictures, ours and Mitsuba 3's, and says whether they show the same light.

For each scene: `photonstream export` writes it for Mitsuba, `photonstream reference` traces it, Mitsuba renders it, each
several times with seeds of their own, all pixels averaged over their whole area (box filter). Compared are the layers
  direct    emitters seen and their light reflected once  (Mitsuba: path, max_depth = 2)
  full      everything                                    (Mitsuba: path, max_depth = -1)
  indirect  full less direct                              (Mitsuba: the difference, from the same seeds)

A layer agrees when
  1. the means of the picture, and of each channel that is not dark, differ by at most --tolerance (0.5 %); the table tells
     the noise: with more than a third of the tolerance, chance may decide, and more paths should;
  2. no block of 8 x 8 and none of 32 x 32 pixels differs, in any channel, by more than --tolerance of its own
     brightness (and 0.01 % of the picture's) plus noise: what is beyond that tolerance must stay below z standard
     deviations, where z is exceeded by chance once in a thousand pictures (two-sided, all blocks and channels counted).
A block's noise is the scatter of its pixels between the runs of both programs (pixels are independent of each other),
and one path of its brightest light: what few paths meet scatters more than four runs tell.
Where our picture is exactly black, Mitsuba may light one pixel in a thousand, by rays that slip through where surfaces meet.
Told, but not judged: the RMS of the blocks' z without any tolerance (1 where the two differ by noise alone).

Setup, outside of the repository:
  python3 -m venv ~/mitsuba && ~/mitsuba/bin/pip install mitsuba==3.9.1 numpy==2.4.6
  cargo build --release && ~/mitsuba/bin/python evaluation/mitsuba/compare.py --photonstream target/release/photonstream
The variant llvm_ad_rgb needs an LLVM newer than 15 on some processors (Debian: libllvm19; DRJIT_LIBLLVM_PATH names the
library); scalar_rgb needs none and is slower.

Exit code: 0 all layers agree, 1 some differ, 2 something could not be run.
"""

import argparse
import datetime
import json
import math
import os
import pathlib
import statistics
import subprocess
import sys

MITSUBA_VERSION = "3.9.1"
LAYERS = ("direct", "indirect", "full")
BLOCKS_PX = (8, 32)
# Blocks count as equal up to this share of the picture's mean, however dark they are.
DARK_SHARE = 1e-4
# A channel below this share of the picture's mean is too dark for a mean of its own.
DARK_CHANNEL = 1e-3
# Share of pixels that Mitsuba may light where our picture is exactly black: rays that slip through its seams.
LEAK_SHARE = 1e-3
# Paths that one call of Mitsuba traces at most: bounds its memory.
LANES = 1 << 23


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="CONFIG[@SECONDS]",
                        help="scene files, animated ones at a moment [default: all of configs/, and all-lights.toml]")
    parser.add_argument("--photonstream", default="photonstream", metavar="BIN", help="the command [default: of the PATH]")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("out/mitsuba"), metavar="DIR",
                        help="folder for exports, pictures and results [default: out/mitsuba]")
    parser.add_argument("--height", type=int, default=240, metavar="PX",
                        help="height of the pictures; the width follows the scene's [default: 240]")
    parser.add_argument("--spp", type=int, default=256, help="paths per pixel of each run [default: 256]")
    parser.add_argument("--runs", type=int, default=4, help="runs of each program, at least 2 [default: 4]")
    parser.add_argument("--seed", type=int, default=1, help="seed of the first run [default: 1]")
    parser.add_argument("--tolerance", type=float, default=0.005, help="relative difference allowed [default: 0.005]")
    parser.add_argument("--variant", default="llvm_ad_rgb", choices=("llvm_ad_rgb", "scalar_rgb", "cuda_ad_rgb"))
    args = parser.parse_args()
    if args.runs < 2:
        parser.error("--runs: noise is known from two runs or more")
    return args


def photonstream(args, *words):
    """Runs the command and returns its JSON."""
    done = subprocess.run([args.photonstream, *map(str, words), "--json"], stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"photonstream {' '.join(map(str, words))}: exit code {done.returncode}")
    return json.loads(done.stdout)


def read_exr(path):
    bitmap = mi.Bitmap(str(path)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False)
    return np.array(bitmap, dtype=np.float64)


def ours(args, folder, size):
    """Pictures [run, y, x, channel] of each layer."""
    runs = {layer: [] for layer in LAYERS}
    for run in range(args.runs):
        out = folder / f"ours-{run}.exr"
        photonstream(args, "reference", folder / "scene.toml", "--out", out, "--size", f"{size[0]}x{size[1]}",
                     "--spp", args.spp, "--seed", args.seed + run, "--filter", "box", "--show", ",".join(LAYERS))
        for layer in LAYERS:
            runs[layer].append(read_exr(folder / f"ours-{run}-{layer}.exr"))
    return {layer: np.array(pictures) for layer, pictures in runs.items()}


def mitsubas(args, folder, size):
    """Pictures [run, y, x, channel] of each layer."""
    scenes = {layer: mi.load_file(str(folder / f"{layer}.xml"), width=str(size[0]), height=str(size[1]))
              for layer in ("direct", "full")}
    passes = max(1, math.ceil(args.spp * size[0] * size[1] / LANES))
    spp = math.ceil(args.spp / passes)
    runs = {layer: [] for layer in LAYERS}
    for run in range(args.runs):
        sums = {}
        for index in range(passes):
            seed = (args.seed + run) * 10_000 + index
            for layer, scene in scenes.items():
                picture = np.array(mi.render(scene, spp=spp, seed=seed), dtype=np.float64)
                sums[layer] = sums.get(layer, 0.0) + picture / passes
        runs["direct"].append(sums["direct"])
        runs["full"].append(sums["full"])
        runs["indirect"].append(sums["full"] - sums["direct"])
    return {layer: np.array(pictures) for layer, pictures in runs.items()}


def noise_variance(runs):
    """Variance of the mean of the runs, of each value."""
    return runs.var(axis=0, ddof=1) / len(runs)


def in_blocks(picture, edge, gather=None):
    """Sums (or what `gather` makes of them) over whole blocks; what is left at right and bottom is not judged."""
    height, width, channels = picture.shape
    rows, columns = height // edge, width // edge
    cut = picture[: rows * edge, : columns * edge]
    return (gather or np.sum)(cut.reshape(rows, edge, columns, edge, channels), axis=(1, 3))


def judge(a, b, paths, tolerance):
    """Figures of a layer, from the runs of ours and Mitsuba's (of so many paths per pixel in all), and its map of
    relative differences."""
    mean_a, mean_b = a.mean(axis=0), b.mean(axis=0)
    variance = noise_variance(a) + noise_variance(b)
    whole = mean_b.mean()
    if mean_a.max() == 0.0:
        lit_share = float((mean_b > 0.0).any(axis=-1).mean())
        return {"mean_ours": 0.0, "mean_mitsuba": float(whole), "dark": True, "lit_share_mitsuba": lit_share,
                "agrees": lit_share <= LEAK_SHARE}, np.zeros((1, 1))
    # A picture that is dark for Mitsuba alone is infinitely different.
    difference = mean_a.mean() / whole - 1.0 if whole != 0.0 else math.inf
    # A path's channels go up and down together: the noise of their mean is not that of three pictures.
    grey = noise_variance(a.mean(axis=-1)) + noise_variance(b.mean(axis=-1))
    noise = math.sqrt(grey.sum()) / grey.size / abs(whole) if whole != 0.0 else 0.0
    lit_channels = [c for c in range(3) if mean_b[..., c].mean() > DARK_CHANNEL * whole]
    channels = [float(mean_a[..., c].mean() / mean_b[..., c].mean() - 1.0) for c in lit_channels]
    figures = {"mean_ours": float(mean_a.mean()), "mean_mitsuba": float(whole), "difference": float(difference),
               "difference_sigma": noise, "difference_channels": channels, "dark": False, "blocks": {}}
    agrees = all(abs(d) <= tolerance for d in [difference, *channels])
    for edge in BLOCKS_PX:
        size = edge * edge
        delta = in_blocks(mean_a - mean_b, edge) / size
        bright = np.maximum(in_blocks(mean_a, edge), in_blocks(mean_b, edge)) / size
        # No pixel is known better than by one path of the brightest light in its block: edges that few paths meet.
        by_one_path = in_blocks(np.maximum(mean_a, mean_b), edge, np.max) / paths
        sigma = np.sqrt(in_blocks(variance, edge) + size * by_one_path**2) / size
        allowed = tolerance * bright + DARK_SHARE * abs(whole)
        beyond = np.maximum(np.abs(delta) - allowed, 0.0)
        z = beyond / np.maximum(sigma, 1e-12 * abs(whole))
        lit = sigma > DARK_SHARE * 1e-2 * abs(whole)
        raw = delta[lit] / sigma[lit]
        limit = statistics.NormalDist().inv_cdf(1.0 - 0.5e-3 / max(delta.size, 1))
        figures["blocks"][edge] = {
            "count": int(delta.size), "limit_z": limit, "largest_z": float(z.max()),
            "rms_raw_z": float(np.sqrt(np.mean(raw**2))) if raw.size else 0.0,
            "rms_relative": float(np.sqrt(np.mean(delta**2)) / abs(whole)),
            "worst_at": [int(i) * edge for i in np.unravel_index(z.argmax(), z.shape)[:2]],
        }
        agrees &= bool(z.max() <= limit)
    figures["agrees"] = bool(agrees)
    delta, bright = (in_blocks(p, BLOCKS_PX[0]).mean(axis=-1) for p in (mean_a - mean_b, mean_b))
    return figures, delta / np.maximum(bright, 1e-2 * abs(whole) * BLOCKS_PX[0] ** 2)


def panel(picture, scale):
    """Display values of a linear picture."""
    return np.clip(picture * scale, 0.0, 1.0) ** (1.0 / 2.2)


def difference_panel(relative, shape):
    """Red: ours is brighter; blue: darker; full colour at 5 %."""
    share = np.clip(relative / 0.05, -1.0, 1.0)[..., None]
    red, blue = np.array([0.8, 0.1, 0.1]), np.array([0.1, 0.2, 0.8])
    colours = 1.0 - np.abs(share) * (1.0 - np.where(share > 0.0, red, blue))
    edge = BLOCKS_PX[0]
    whole = np.ones(shape)
    large = colours.repeat(edge, axis=0).repeat(edge, axis=1)[: shape[0], : shape[1]]
    whole[: large.shape[0], : large.shape[1]] = large
    return whole


def write_png(path, picture):
    mi.Bitmap((picture * 255.0 + 0.5).astype(np.uint8)).write(str(path))


def compare(args, text):
    """Figures of each layer of a scene, and its row of the figure: ours, Mitsuba's, differences of the three layers."""
    config, _, seconds = text.partition("@")
    name = pathlib.Path(config).stem + (f"@{seconds}" if seconds else "")
    folder = args.out / name.replace("@", "-at-")
    folder.mkdir(parents=True, exist_ok=True)
    photonstream(args, "export", config, "--mitsuba", folder, "--time", seconds or "0")
    checked = photonstream(args, "check", folder / "scene.toml")
    size = (max(1, round(args.height * checked["width_px"] / checked["height_px"])), args.height)
    a, b = ours(args, folder, size), mitsubas(args, folder, size)
    result = {"scene": name, "scene_hash": checked["scene_hash"], "width_px": size[0], "height_px": size[1], "layers": {}}
    brightness = 0.4 / max(b["full"].mean(), 1e-30)
    row = [panel(a["full"].mean(axis=0), brightness), panel(b["full"].mean(axis=0), brightness)]
    for layer in LAYERS:
        result["layers"][layer], relative = judge(a[layer], b[layer], args.spp * args.runs, args.tolerance)
        row.append(difference_panel(relative, row[0].shape))
    for panel_name, picture in zip(("ours", "mitsuba", *LAYERS), row):
        write_png(folder / f"{panel_name}.png", picture)
    return result, np.concatenate(row, axis=1)


def table(results):
    """The figures as lines of Markdown."""
    lines = ["| scene | layer | mean, ours | mean, Mitsuba | difference | its noise (1 σ) | largest z beyond tolerance, "
             "8² / limit | 32² / limit | RMS z without tolerance, 8² | agrees |", "|" + "---|" * 10]
    for result in results:
        for layer, f in result["layers"].items():
            start = f"| `{result['scene']}` | {layer} | {f['mean_ours']:.6g} | {f['mean_mitsuba']:.6g} |"
            if f["dark"]:
                lit = f"ours black; Mitsuba lights {f['lit_share_mitsuba']:.3%} of the pixels"
                lines.append(f"{start} {lit} | | | | | {'yes' if f['agrees'] else '**no**'} |")
                continue
            blocks = " | ".join(f"{b['largest_z']:.1f} / {b['limit_z']:.1f}" for b in f["blocks"].values())
            lines.append(f"{start} {f['difference']:+.3%} | {f['difference_sigma']:.3%} | {blocks} | "
                         f"{f['blocks'][BLOCKS_PX[0]]['rms_raw_z']:.2f} | {'yes' if f['agrees'] else '**no**'} |")
    return "\n".join(lines)


def main():
    args = arguments()
    global mi, np
    try:
        import mitsuba as mi
        import numpy as np
    except ImportError as error:
        print(f"{error}; pip install mitsuba=={MITSUBA_VERSION} numpy (see --help)", file=sys.stderr)
        return 2
    if mi.__version__ != MITSUBA_VERSION:
        print(f"note: Mitsuba {mi.__version__}; the recorded figures are of {MITSUBA_VERSION}", file=sys.stderr)
    mi.set_variant(args.variant)
    root = pathlib.Path(__file__).resolve().parents[2]
    found = sorted((root / "configs").glob("*.toml")) + [root / "evaluation/mitsuba/all-lights.toml"]
    scenes = args.scenes or [os.path.relpath(path) for path in found]
    args.out.mkdir(parents=True, exist_ok=True)
    results, rows, failed = [], [], 0
    for scene in scenes:
        try:
            result, row = compare(args, scene)
        except (RuntimeError, OSError) as error:
            print(f"{scene}: {error}", file=sys.stderr)
            failed += 1
            continue
        results.append(result)
        rows.append(row)
        print(table([result]), flush=True)
    report = {"date": datetime.date.today().isoformat(), "mitsuba": mi.__version__, "variant": args.variant,
              "spp": args.spp, "runs": args.runs, "seed": args.seed, "tolerance": args.tolerance, "scenes": results}
    (args.out / "results.json").write_text(json.dumps(report, indent=1) + "\n")
    (args.out / "results.md").write_text(table(results) + "\n")
    if rows:
        width = max(row.shape[1] for row in rows)
        padded = [np.pad(row, ((0, 4), (0, width - row.shape[1]), (0, 0)), constant_values=1.0) for row in rows]
        write_png(args.out / "differences.png", np.concatenate(padded))
    if failed:
        return 2
    return 0 if all(f["agrees"] for result in results for f in result["layers"].values()) else 1


if __name__ == "__main__":
    sys.exit(main())
