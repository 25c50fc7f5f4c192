#!/usr/bin/env python3
"""Makes the fonts of figures: the letters that figures may use, out of Roboto (Apache-2.0).

Run by hand; its output is committed. Needs fonttools 4.68.

    pip download --no-deps --no-binary :all: font-roboto==0.0.1
    tar xzf font-roboto-0.0.1.tar.gz
    tools/font.py font-roboto-0.0.1/font_roboto/files data/fonts
"""

import hashlib
import pathlib
import sys

from fontTools import subset

# What people may type as the name of a condition or a task type, and what captions say.
LETTERS = "".join(map(chr, range(0x20, 0x7F))) + "".join(map(chr, range(0xA0, 0x180))) + "–—−‘’“”…·×±≤≥→τβμσ"


def main(source, target):
    target.mkdir(parents=True, exist_ok=True)
    for weight in ["Regular", "Bold"]:
        options = subset.Options()
        options.layout_features = ["kern", "mark"]
        options.hinting = False
        options.name_IDs = [0, 1, 2, 3, 4, 5, 6, 13, 14]
        options.recalc_timestamp = False
        font = subset.load_font(source / f"Roboto-{weight}.ttf", options)
        subsetter = subset.Subsetter(options)
        subsetter.populate(text=LETTERS)
        subsetter.subset(font)
        path = target / f"Roboto-{weight}.ttf"
        subset.save_font(font, path, options)
        print(path.name, path.stat().st_size, hashlib.sha256(path.read_bytes()).hexdigest())


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
