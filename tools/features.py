#!/usr/bin/env python3
"""Learns the constants of the `features` parser from recorded sentences, and measures them.

Run by hand; the output is committed. Needs numpy. Reads ../shared/data (see the README there), the
household's names, words and seeds in crates/household/data, and crates/mind/data/words/default.words. Writes

    crates/household/data/habits.toml   how often each word stood in a clause that meant each primitive
    crates/mind/data/recipes/default-1.toml    from its mark on: the weights of the two judges, the lists of words

No sentence of the recordings is written: counts of single words, and weights.

    tools/features.py                     learn from the choosing people, write both files
    tools/features.py --measure folds     each quarter of the choosing people, learned on the others
    tools/features.py --measure final     learn on the choosing people, measure on the held-out ones

A third of the annotators (by SHA-256 of their id) is held out: only `--measure final` reads them.
The model is described in docs/features.md; the names here are those of that text.
"""
import argparse
import collections
import gzip
import hashlib
import json
import math
import random
import re
import struct
import tomllib
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
SHARED = ROOT.parent / "shared" / "data"
PRIMITIVES = ["GOTO", "PICKUP", "PUT", "TOGGLE", "OPEN", "CLOSE"]
MANIPULATIONS = ("PICKUP", "PUT", "TOGGLE")
TAUGHT = ("CleanObject", "HeatObject", "CoolObject")

# ---------------------------------------------------------------- lists of words (shipped as data)
LISTS = {
    # Carry no meaning of their own: no item of a vector, no feature.
    "silent": "the a an of that is are it this",
    "determiners": "the a an that this these those some another one your its his her their my any each both two three",
    "particles": "up down on off out back over away in",
    # Particles that make another verb of a verb: "turn on", "pick up".
    "verb_particles": "up on off down out back over away",
    "adverbs": "carefully gently slowly quickly please now just also then next finally again back once immediately simply",
    # Words that may stand between two clauses.
    "joints": "and then before after while next finally afterwards again also",
    # Where an utterance is cut, if a verb follows. Punctuation marks cut as well.
    "cuts": "and then before after while",
    "stop": "the a an of in to on at from with for is are was be been so as if or and then by next left right front back"
    " top side into onto inside near under underneath over above below behind between beside off out up down there here it"
    " them you your that which who where when not no facing against across around along past through until toward towards"
    " beneath atop besides within amongst among except whilst upon during",
    # A part of a thing is the thing: "a slice of the apple", "apple slices".
    "portions": "slice piece chunk half section quarter wedge part portion segment",
    # Verbs that are nouns as well: verbs only where a clause begins and an object follows.
    "noun_verbs": "microwave clean cool light warm open dry face stand step water season plate salt cover stack watch back"
    " shower soap sponge iron plug rest position center ice freeze cold frost ready lock place",
    "toward": "to toward towards at face facing into reach approach near by",
    "inside": "in inside into",
    "standing": "holding carrying",
    "moving": "turn look face step walk go move head",
    # Before a verb: what follows is what the rest is for ("to chill").
    "purposes": "to let",
    "lasting": "until moment moments seconds minute minutes wait",
    # Before a mention: where a way ends, and where it begins.
    "destination": "to toward towards",
    "leaving": "from",
    "wherever": "where",
    "onto": "on onto to",
    "passed": "up down back away both",
    "carrying_on": "up back down off",
}
LISTS = {name: words.split() for name, words in LISTS.items()}
# Several words each, determiners aside: the mention behind them is a landmark.
LISTS["landmarks"] = ["beside", "behind", "near", "by", "under", "underneath", "beneath", "below",
                      "above", "between", "next to", "close to", "front of", "to left of", "to right of"]
SETS = {name: set(words) for name, words in LISTS.items()}
NO_VERBS = set("back light cool cold clean dry warm ready open position center face stand step dust salt pepper spread"
               " butter rest show ice frost core crack hose shower soap sponge iron plug stack pile cover mount range plate"
               " taste water exit".split())


def listed_verbs():
    verbs, section = set(), ""
    for line in (ROOT / "crates/mind/data/words/household.txt").read_text().splitlines():
        line = line.split("#")[0].strip()
        if line.startswith("["):
            section = line.strip("[]")
        elif section == "verbs":
            verbs |= set(line.split())
    return (verbs - NO_VERBS) | {"make", "use", "have", "be"}


VERBS = listed_verbs()
LISTS["verbs"] = sorted(VERBS)

# ---------------------------------------------------------------- the household
TYPES = tomllib.loads((ROOT / "crates/household/data/types.toml").read_text())
NAMES = {tuple(name.split()): kinds for name, kinds in tomllib.loads((ROOT / "crates/household/data/names.toml").read_text()).items()}
WORDS = tomllib.loads((ROOT / "crates/household/data/words.toml").read_text())
SEEDS = tomllib.loads((ROOT / "crates/household/data/seeds.toml").read_text())
ADJECTIVES, PRONOUNS, PLURALS, FIXTURES = (WORDS[k] for k in ("adjectives", "pronouns", "plurals", "fixtures"))
ADJECTIVES, PRONOUNS = set(ADJECTIVES), set(PRONOUNS)
LONGEST = max(map(len, NAMES))
flagged = lambda flag: {kind for kind, facts in TYPES.items() if flag in facts.get("flags", [])}
PICKUPABLE, RECEPTACLE, OPENABLE, TOGGLEABLE = map(flagged, ("pickupable", "receptacle", "openable", "toggleable"))


class Mention:
    """Words that name something. `types`: from type to count, likeliest first; `fixture`: its word."""

    def __init__(self, name, types, pronoun, fixture):
        self.name, self.types, self.pronoun, self.fixture = name, types, pronoun, fixture

    def __repr__(self):
        return f"<{self.fixture or 'obj'}>"


def singular(word):
    if word in PLURALS:
        return PLURALS[word]
    return word[:-1] if len(word) > 3 and word.endswith("s") and not word.endswith("ss") else word


def tokens(text):
    found = re.findall(r"[a-z]+(?:-[a-z]+)*(?:'[a-z]+)?|[0-9]+|[,.;:!]", text.lower().replace("’", "'"))
    return [re.sub(r"'(s|re|ve|ll|d|m)$", "", token) for token in found]


def fixture_of(types):
    """The word of the fixture that at least 30 % of a name's uses mean."""
    total = sum(types.values())
    words = sorted({FIXTURES[kind] for kind, count in types.items() if kind in FIXTURES and count >= 0.3 * total})
    return words[0] if words else None


def is_mark(piece):
    return isinstance(piece, str) and piece in ",.;:!"


def lift(text):
    """Words, marks and mentions, in order. What surrounds a name (adjectives, "a slice of") is swallowed."""
    words, out, at = tokens(text), [], 0
    while at < len(words):
        word = words[at]
        after = words[at + 1] if at + 1 < len(words) else "."
        if word in PRONOUNS or (word in ("this", "that", "these", "those") and after in ",.;"):
            out.append(Mention(word, {}, True, None))
            at += 1
            continue
        hit = None
        for length in range(min(LONGEST, len(words) - at), 0, -1):
            for key in (tuple(words[at : at + length]), (*words[at : at + length - 1], singular(words[at + length - 1]))):
                if key in NAMES:
                    hit = (length, key)
            if hit:
                break
        if hit and hit[0] == 1:
            opens = not out or is_mark(out[-1]) or (isinstance(out[-1], str) and out[-1] in ("and", "then", "to", "or"))
            object_follows = after in SETS["determiners"] or after in PRONOUNS or (after,) in NAMES or (singular(after),) in NAMES
            if word in VERBS | SETS["noun_verbs"] and opens and object_follows:
                if not (out and out[-1] == "to" and after not in SETS["determiners"] | PRONOUNS):
                    hit = None
            elif word in ADJECTIVES and ((after,) in NAMES or (singular(after),) in NAMES or after in ADJECTIVES):
                hit = None
        if not hit:
            out.append(word)
            at += 1
            continue
        length, key = hit
        swallow(out)
        back = len(out) - 1
        while back >= 0 and isinstance(out[back], str) and out[back] in SETS["determiners"]:
            back -= 1
        if back >= 1 and out[back] == "of" and isinstance(out[back - 1], str) and singular(out[back - 1]) in SETS["portions"]:
            del out[back - 1 :]
            swallow(out)
        while at + length < len(words) and singular(words[at + length]) in SETS["portions"]:
            length += 1
        if out and isinstance(out[-1], Mention) and not out[-1].pronoun:
            out.pop()
        types = dict(sorted(NAMES[key].items(), key=lambda item: (-item[1], item[0])))
        out.append(Mention(" ".join(key), types, False, fixture_of(types)))
        at += length
    return out


def swallow(out):
    while out and isinstance(out[-1], str) and out[-1] in ADJECTIVES and len(out) > 1:
        out.pop()


def is_verb(word, after):
    if not isinstance(word, str) or not word.isalpha():
        return False
    if word in SETS["noun_verbs"]:
        return isinstance(after, Mention) or (isinstance(after, str) and after in SETS["determiners"] | {"up", "back", "down", "off"})
    if word in VERBS or (word.endswith("ing") and len(word) > 5):
        return True
    unknown = word not in SETS["stop"] | SETS["determiners"] and word not in ADJECTIVES
    return unknown and (isinstance(after, str) and after in SETS["determiners"] or isinstance(after, Mention) and after.pronoun)


def cut(pieces):
    """The clauses: cut at marks and joining words, but only where a verb follows."""
    out, at = [[]], 0
    while at < len(pieces):
        piece = pieces[at]
        if is_mark(piece) or (isinstance(piece, str) and piece in SETS["cuts"]):
            ahead = at
            while ahead < len(pieces) and isinstance(pieces[ahead], str) and (
                is_mark(pieces[ahead]) or pieces[ahead] in SETS["joints"] | SETS["adverbs"]
            ):
                ahead += 1
            if ahead >= len(pieces):
                break
            if is_verb(pieces[ahead], pieces[ahead + 1] if ahead + 1 < len(pieces) else None):
                if out[-1]:
                    out.append([])
                at = ahead
                continue
            if is_mark(piece):
                at += 1
                continue
        out[-1].append(piece)
        at += 1
    out = [clause for clause in out if clause]
    # "while holding the card" says how things stand, not what to do.
    acts = [clause for clause in out if not (clause[0] in SETS["standing"])]
    return acts or out


def base(word):
    """closing: close; picking: pick; putting: put."""
    if word.endswith("ing") and word not in VERBS:
        stem = word[:-3]
        for form in (stem, stem + "e", stem[:-1]):
            if form in VERBS | SETS["noun_verbs"]:
                return form
    return word


def main_verb(clause):
    """The first word that may be a verb, and the particle that belongs to it."""
    skip = SETS["silent"] | SETS["adverbs"] | SETS["particles"] | SETS["stop"]
    for place, word in enumerate(clause):
        if isinstance(word, str) and word not in skip and word not in ADJECTIVES and not word.isdigit():
            for next_word in clause[place + 1 : place + 6]:
                if isinstance(next_word, str) and next_word in SETS["verb_particles"]:
                    return base(word), next_word, place
                if isinstance(next_word, str) and next_word in SETS["stop"] - SETS["silent"] - SETS["determiners"]:
                    break
            return base(word), "", place
    return "", "", -1


def mentions(clause):
    return [piece for piece in clause if isinstance(piece, Mention)]


# ---------------------------------------------------------------- vectors
class Table:
    SIF = 1e-3

    def __init__(self, path):
        data = path.read_bytes()
        assert data[:4] == b"APWT"
        _, self.dims, count = struct.unpack("<III", data[4:16])
        at, self.places = 16, {}
        for place in range(count):
            length = data[at]
            self.places[data[at + 1 : at + 1 + length].decode()] = place
            at += 1 + length
        at += 4 * count  # the scale does not matter: rows become unit vectors
        self.frequency = np.frombuffer(data, "<f4", count, at)
        rows = np.frombuffer(data, np.int8, count * self.dims, at + 4 * count).reshape(count, self.dims).astype(np.float32)
        self.rows = rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-9)
        self.hashed = {}

    def vector(self, word):
        place = self.places.get(word)
        if place is not None:
            return self.rows[place]
        if word not in self.hashed:
            seed = int(hashlib.sha256(word.encode()).hexdigest()[:8], 16)
            row = np.random.RandomState(seed).randn(self.dims).astype(np.float32)
            self.hashed[word] = row / np.linalg.norm(row)
        return self.hashed[word]

    def weight(self, word):
        place = self.places.get(word)
        return self.SIF / (self.SIF + (self.frequency[place] if place is not None else 1e-7))

    def items(self, pieces):
        """(kind, word, vector, weight) of what carries meaning."""
        out = []
        for piece in pieces:
            if isinstance(piece, Mention):
                kind = ("fixture", piece.fixture, 0.4) if piece.fixture else ("object", "object", 0.15)
                out.append((kind[0], kind[1], self.vector(kind[1]), kind[2]))
            elif is_mark(piece) or piece in SETS["silent"]:
                continue
            else:
                out.append(("word", piece, self.vector(piece), 0.25 if piece in SETS["particles"] else self.weight(piece)))
        return out


def unit(vector):
    norm = np.linalg.norm(vector)
    return vector / norm if norm > 0 else vector


def sigmoid(z):
    return 1.0 / (1.0 + np.exp(-z))


# ---------------------------------------------------------------- habits: the statistics of words
def habit_words(clause):
    verb, particle, at = main_verb(clause)
    features = {"V:" + verb, f"n:{min(len(mentions(clause)), 3)}"}
    if particle:
        features.add(f"V:{verb}_{particle}")
    seen = False
    for place, piece in enumerate(clause):
        if isinstance(piece, Mention):
            seen = True
        elif place != at and piece not in SETS["determiners"]:
            if seen is True and piece in SETS["stop"]:
                features.add(f"V:{verb}+{piece}")  # "take it TO", "take it FROM"
            seen = None if seen else seen
            features.add(piece)
    return features


def seed_pieces(text):
    def piece(word):
        if not word.startswith("<"):
            return word
        fixture = word[1:-1].split("=")[1] if "=" in word else None
        return Mention(word, {}, False, fixture)

    return [piece(word) for word in text.split()]


def seed_clauses():
    """What everybody starts with counts as if it had been said a few times."""
    pairs = [(cut(seed_pieces(text)), program.split()[0]) for text, program in SEEDS["exemplars"]]
    return [(clauses[-1], primitive, 5) for clauses, primitive in pairs]


class Habits:
    """In how many clauses that meant each primitive a word stood."""

    SMOOTHING, RARE, KEEP = 0.3, 3, 5

    def __init__(self, labelled):
        self.clauses = collections.Counter(label for _, label in labelled)
        counts = collections.defaultdict(lambda: [0] * len(PRIMITIVES))
        for clause, label, times in [(*pair, 1) for pair in labelled] + seed_clauses():
            for word in habit_words(clause):
                counts[word][PRIMITIVES.index(label)] += times
        self.counts = {word: row for word, row in sorted(counts.items()) if sum(row) >= self.KEEP}
        self.all = sum(self.clauses.values())

    def count(self, word, primitive):
        return self.counts.get(word, [0] * len(PRIMITIVES))[PRIMITIVES.index(primitive)]

    def rate(self, word):
        """The share of clauses in which a word stood, as verb or not."""
        return (sum(self.counts.get(word, ())) + sum(self.counts.get("V:" + word, ()))) / self.all

    def scores(self, clause, blind=False):
        """Naive Bayes: one number a primitive. `blind`: as if nobody had ever used the verb."""
        rows = [self.counts[word] for word in sorted(habit_words(clause))
                if word in self.counts and not (blind and word.startswith("V:"))]
        out = []
        for place, primitive in enumerate(PRIMITIVES):
            n = self.clauses[primitive]
            score = 0.5 * math.log(min(n, 2000) + 5)
            out.append(score + sum(math.log((row[place] + self.SMOOTHING) / (n + 20 * self.SMOOTHING)) for row in rows))
        return out


# ---------------------------------------------------------------- the primitive judge
PRIMITIVE_FEATURES = ["cosine", "verb", "margin", "verb_margin", "length", "habit", "verb_habit", "particle_habit", "unfamiliar", "nothing_named", "one"]


FLOOR = 0.3  # no primitive is believed below this, whatever the calibration allows
BLIND = 0.5  # the weight of a clause whose verb is hidden from the judge


class PrimitiveJudge:
    def __init__(self, table, habits, off=()):
        self.table, self.habits, self.weights, self.threshold = table, habits, None, 0.5
        self.mask = np.array([0.0 if name in off else 1.0 for name in PRIMITIVE_FEATURES])
        seeds = [(seed_pieces(text), program.split()[0]) for text, program in SEEDS["exemplars"]]
        self.vectors = np.array([unit(sum(w * v for _, _, v, w in table.items(pieces))) for pieces, _ in seeds])
        self.seed_verbs = [main_verb(cut(pieces)[-1])[0] for pieces, _ in seeds]
        self.verbs = np.array([table.vector(verb) for verb in self.seed_verbs])
        self.of = np.array([PRIMITIVES.index(program) for _, program in seeds])
        self.cache = {}

    def features(self, clause, blind=False):
        """primitives x features. `blind`: as if neither the seeds nor anybody had the clause's verb."""
        items = self.table.items(clause)
        verb, particle, at = main_verb(clause)
        whole = unit(sum((w * v for _, _, v, w in items), np.zeros(self.table.dims, np.float32)))
        cosines = self.vectors @ whole
        verbs = self.verbs @ self.table.vector(verb) if verb else np.zeros(len(self.of))
        habits = self.habits.scores(clause, blind)
        known = np.array([not (blind and other == verb) for other in self.seed_verbs])
        unfamiliar = 0.0
        for place, word in enumerate(clause):
            if isinstance(word, str) and place != at and word.isalpha() and word not in SETS["silent"] | SETS["determiners"]:
                if word not in ADJECTIVES and word not in self.habits.counts and "V:" + word not in self.habits.counts:
                    unfamiliar += self.table.weight(word)
        length = min(sum(not (isinstance(p, str) and p in SETS["silent"]) for p in clause), 12) / 10
        out = np.zeros((len(PRIMITIVES), len(PRIMITIVE_FEATURES)))
        for place, primitive in enumerate(PRIMITIVES):
            own, rest = (self.of == place) & known, (self.of != place) & known
            if not own.any() or not rest.any():
                continue
            other = max(score for i, score in enumerate(habits) if i != place)
            out[place] = [
                cosines[own].max(), verbs[own].max(),
                cosines[own].max() - cosines[rest].max(), verbs[own].max() - verbs[rest].max(), length,
                max(-6.0, min(6.0, habits[place] - other)) / 3,
                math.log(1 + self.habits.count("V:" + verb, primitive)) / 5 if verb and not blind else 0.0,
                math.log(1 + self.habits.count(f"V:{verb}_{particle}" if particle else "V:" + verb, primitive)) / 5 if verb and not blind else 0.0,
                min(unfamiliar, 3.0), float(not mentions(clause)), 1.0,
            ]
        return out * self.mask

    def logits(self, clause):
        key = " ".join(map(repr, clause))
        if key not in self.cache:
            self.cache[key] = self.features(clause) @ self.weights
        return self.cache[key]

    def learn(self, labelled, untaught, rng):
        """Positives: recorded clauses. Negatives: other primitives, verbs that nobody used, other requests."""
        rows, answers, weights = [], [], []

        def add(row, answer, weight):
            rows.append(row), answers.append(answer), weights.append(weight)

        strange = [verb for verb in LISTS["verbs"] if "V:" + verb not in self.habits.counts]
        by_label = {primitive: [pair for pair in labelled if pair[1] == primitive] for primitive in PRIMITIVES}
        sample = [pair for some in by_label.values() for pair in rng.sample(some, min(700, len(some)))]
        for clause, label in sample:
            features = self.features(clause)
            right = PRIMITIVES.index(label)
            add(features[right], 1, 1.0)
            for wrong in rng.sample([i for i in range(len(PRIMITIVES)) if i != right], 2):
                add(features[wrong], 0, 1.0)
            if rng.random() < 0.25:
                add(self.features(clause, blind=True)[right], 1, BLIND)
            at = main_verb(clause)[2]
            if at >= 0 and rng.random() < 0.35:
                other = list(clause)
                other[at] = rng.choice(strange)
                add(self.features(other)[int(np.argmax(self.habits.scores(other)))], 0, 2.0)
        for clauses in untaught:
            if len(clauses) == 1:
                add(self.features(clauses[0])[int(np.argmax(self.habits.scores(clauses[0])))], 0, 1.5)
        self.weights = logistic(np.array(rows), np.array(answers, float), np.array(weights)) * self.mask
        self.cache = {}

    def calibrate(self):
        """The threshold, from the seeds' variants and synthetic unknown requests alone."""
        def judged(text):
            """The surest primitive of the last clause, and how sure all clauses are."""
            logits = [self.logits(clause) for clause in cut(seed_pieces(text))]
            return PRIMITIVES[int(np.argmax(logits[-1]))], float(np.prod([sigmoid(l.max()) for l in logits]))

        unknown = sorted(judged(text)[1] for text in SEEDS["unknown"])
        self.threshold = min(0.9, max(FLOOR, unknown[int(0.95 * len(unknown))]))
        passes = lambda pair: judged(pair[0])[0] == pair[1].split()[0] and judged(pair[0])[1] >= self.threshold
        good, seeds = [passes(pair) for pair in SEEDS["variants"]], [passes(pair) for pair in SEEDS["exemplars"]]
        return {"threshold": self.threshold, "variants": np.mean(good), "seeds": np.mean(seeds),
                "unknown": np.mean([score >= self.threshold for score in unknown]),
                "lost seeds": [text for (text, _), ok in zip(SEEDS["exemplars"], seeds) if not ok]}


def logistic(rows, answers, weights, ridge=1e-4, rounds=60):
    """Weighted ridge logistic regression by Newton's method."""
    w = np.zeros(rows.shape[1])
    for _ in range(rounds):
        p = sigmoid(rows @ w)
        gradient = rows.T @ (weights * (p - answers)) + ridge * len(answers) * w
        hessian = (rows * (weights * p * (1 - p))[:, None]).T @ rows + ridge * len(answers) * np.eye(rows.shape[1])
        step = np.linalg.solve(hessian, gradient)
        w -= step
        if np.abs(step).max() < 1e-7:
            break
    return w


# ---------------------------------------------------------------- what the world allows
class Moment:
    """What is in the scene and in the hand, what the robot stands at, and what was named before."""

    def __init__(self, present, held, at):
        self.present, self.held, self.at = present, held, at
        self.last, self.container = None, at if at in OPENABLE else None

    def meanings(self, mention):
        if mention.pronoun:
            thing = self.held or self.last
            return [thing] if thing else []
        return [kind for kind in mention.types if kind in self.present]


def names_unknown(clause):
    """Whether words that name nothing known stand between the verb and the first preposition."""
    for piece in clause[main_verb(clause)[2] + 1 :]:
        if isinstance(piece, Mention):
            return False
        if piece in SETS["determiners"] or piece in ADJECTIVES or piece in ("up", "down", "back", "away", "both"):
            continue
        return piece not in SETS["stop"]
    return False


def arguments(primitive, clause, moment):
    """The first choice of mentions, in order, that the world allows, and its penalty; or None."""
    named = mentions(clause)
    said = {piece for piece in clause if isinstance(piece, str)}
    means = [moment.meanings(mention) for mention in named]
    held, at, container = moment.held, moment.at, moment.container
    if primitive == "GOTO":
        order, before = [], []
        for piece in clause:
            if not isinstance(piece, Mention):
                before.append(piece)
                continue
            directed = bool(set(before) & SETS["toward"])
            if directed and "where" in before:
                return None  # "back to where the potato is": the place, not the potato
            order.append((0 if directed else 1, len(order)))
            before = []
        for _, place in sorted(order):
            kinds = [kind for kind in means[place] if kind != held or len(named) == 1]
            if kinds:
                return [kinds[0]], 0.0
            if not named[place].pronoun and held not in named[place].types:
                return None
        return None
    if primitive in ("OPEN", "CLOSE", "TOGGLE"):
        able = TOGGLEABLE if primitive == "TOGGLE" else OPENABLE
        for place, mention in enumerate(named):
            for kind in means[place]:
                if kind in able:
                    return [kind], float(place)
            if mention.pronoun and primitive != "TOGGLE" and container:
                return [container], float(place)
        if primitive != "TOGGLE" and not named:
            place = container or (at if at in OPENABLE else None)
            return ([place], 0.0) if place else None
        return None
    if primitive == "PICKUP":
        if held:
            return None
        for place, mention in enumerate(named):
            for kind in means[place]:
                if kind in PICKUPABLE:
                    return [kind], float(place)
            if (not mention.pronoun and PICKUPABLE & set(mention.types)) or names_unknown(clause):
                return None
        if not named and moment.last in PICKUPABLE and not names_unknown(clause):
            return [moment.last], 1.0
        return None
    if not held:
        return None
    own = next((i for i, mention in enumerate(named) if mention.pronoun or held in mention.types), None)
    penalty = 0.0
    if own is None and not names_unknown(clause):
        if len(named) >= 2:
            own, penalty = 0, 2.0
        elif len(named) == 1 and said & (SETS["inside"] | {"on", "onto", "to"}):
            penalty = 1.0
        else:
            return None
    rest = [i for i in range(len(named)) if i != own]
    for skipped, place in enumerate(rest):
        kinds = [kind for kind in means[place] if kind in RECEPTACLE and kind != held]
        if named[place].pronoun:
            kinds = [container] if container else []
        if kinds:
            return [held, at if at in kinds else kinds[0]], penalty + 0.5 * skipped
    if container and said & SETS["inside"] and not rest:
        return [held, container], penalty
    if at in RECEPTACLE and at != held:
        return [held, at], penalty + (1.0 if rest else 0.0)
    return None


def read(clauses, judge, moment):
    """The clauses as primitives: (steps, score); no steps when it is not sure."""
    steps, score, placed = [], 1.0, set()
    for clause in clauses:
        logits = judge.logits(clause)
        top = int(np.argmax(logits))
        verb = main_verb(clause)[0]
        named = mentions(clause)
        if not named and PRIMITIVES[top] == "GOTO" and (verb in SETS["moving"] or judge.habits.count("V:" + verb, "GOTO") >= 3):
            continue  # "turn around": nothing that this world's primitives could do
        if not named and PRIMITIVES[top] in ("OPEN", "CLOSE") and not moment.container:
            score *= float(sigmoid(logits[top]))
            continue
        choices = []
        for place, primitive in enumerate(PRIMITIVES):
            chosen = arguments(primitive, clause, moment)
            if chosen:
                choices.append((logits[place] - 0.5 * chosen[1], primitive, chosen[0]))
        if not choices:
            if PRIMITIVES[top] == "GOTO" and len(clauses) > 1:
                score *= float(sigmoid(logits[top]))
                continue  # a landmark on the way that is not here
            return [], 0.0
        logit, primitive, args = max(choices, key=lambda choice: choice[0])
        if PRIMITIVES[top] != primitive and logits[top] - logit > 2.5:
            return [], 0.0
        score *= float(sigmoid(logit))
        steps.append(" ".join([primitive, *args]))
        if primitive in ("PICKUP", "GOTO") and args[0] in placed:
            return [], 0.0  # put down and taken again: it was for something that was not understood
        if primitive == "PICKUP":
            moment.held = args[0]
        elif primitive == "PUT":
            placed.add(args[0])
            moment.held = None
        elif primitive == "OPEN":
            moment.container = args[0]
        moment.last = args[0]
        for mention in named:
            moment.container = next((kind for kind in moment.meanings(mention) if not mention.pronoun and kind in OPENABLE), moment.container)
    return (steps, score) if steps else ([], 0.0)


# ---------------------------------------------------------------- the lesson judge
LESSON_FEATURES = ["cosine", "rare_cosine", "cover", "cover_back", "new", "new_back", "verb", "fixture_shared", "fixture_foreign",
                   "lead", "primitive", "steps_shared", "undone", "length", "about_program", "one"]


class Said:
    """What the lesson judge knows of an utterance: lifted words alone, no scene."""

    RARE = 0.01

    def __init__(self, pieces, judge):
        table, habits = judge.table, judge.habits
        self.pieces = [piece for piece in pieces if not is_mark(piece)]
        self.form = " ".join(repr(piece) for piece in self.pieces if not (isinstance(piece, str) and piece in SETS["determiners"]))
        self.clauses = cut(pieces)
        self.items = table.items(self.pieces)
        self.vectors = np.array([v for _, _, v, _ in self.items]).reshape(-1, table.dims)
        self.weights = np.array([w for _, _, _, w in self.items])
        self.rare = np.array([
            w if kind != "word" else self.RARE / (self.RARE + habits.rate(word)) * min(1.0, 0.2 + table.weight(word))
            for kind, word, _, w in self.items
        ])
        self.new = [i for i, (kind, word, _, _) in enumerate(self.items)
                    if kind == "word" and word.isalpha() and word not in SETS["stop"] and habits.rate(word) < 0.01]
        zero = np.zeros(table.dims, np.float32)
        self.whole = unit((self.weights[:, None] * self.vectors).sum(0) if self.items else zero)
        self.rare_whole = unit((self.rare[:, None] * self.vectors).sum(0) if self.items else zero)
        self.verbs = [table.vector(main_verb(clause)[0]) for clause in self.clauses if main_verb(clause)[0]]
        self.fixtures = {piece.fixture for piece in self.pieces if isinstance(piece, Mention) and piece.fixture}
        self.seed_cosine = float((judge.vectors @ self.whole).max())
        self.primitive, self.undone, self.steps = self.literal(judge)

    def literal(self, judge):
        """How sure the primitive judge is of every clause; whether something is put down and taken
        again; and what is said of putting, toggling and picking up, with the fixture named for it."""
        sure, undone, steps, put, container = 1.0, False, set(), False, None
        for clause in self.clauses:
            logits = judge.logits(clause)
            top = PRIMITIVES[int(np.argmax(logits))]
            verb, named = main_verb(clause)[0], mentions(clause)
            if not (not named and top == "GOTO" and (verb in SETS["moving"] or judge.habits.count("V:" + verb, "GOTO") >= 3)):
                sure *= float(sigmoid(logits.max()))
            fixture = next((mention.fixture for mention in named if mention.fixture), None)
            if logits.max() > -1.0:
                if top == "PUT":
                    steps.add("PUT " + (fixture or container or "*"))
                    put = True
                elif top == "TOGGLE":
                    steps.add("TOGGLE " + (fixture or container or "*"))
                elif top == "PICKUP":
                    steps.add("PICKUP *")
                if put and top in ("PICKUP", "GOTO") and (top == "PICKUP" or any(m.pronoun for m in named)):
                    undone = True
            container = fixture or container
        return (0.0 if undone else sure), undone, steps


class Lesson:
    """An utterance and its program: what it does with fixtures."""

    def __init__(self, said, program, constants=None):
        self.said = said
        self.program = program
        self.steps, self.fixtures = set(), set()
        first = next((step.split()[0] for step in program if step.split()[0] in MANIPULATIONS), "")
        # A lesson that begins with the thing in the hand names one request; one that first fetches
        # it names a whole task, in which a fixture may be no more than the place where it ends.
        self.kind = "request" if first == "PUT" else "task"
        for step in program:
            operator, *args = step.split()
            words = [FIXTURES[arg] for arg in args if arg in FIXTURES]
            self.fixtures |= set(words)
            if operator in MANIPULATIONS:
                self.steps.add(operator + " " + (words[-1] if words and operator != "PICKUP" else "*"))


class LessonJudge:
    def __init__(self, judge, off=()):
        self.judge, self.weights = judge, {}
        self.mask = np.array([0.0 if name in off else 1.0 for name in LESSON_FEATURES])

    def features(self, said, lesson):
        own = lesson.said
        if not said.items or not own.items:
            return np.zeros(len(LESSON_FEATURES))
        near = np.maximum(said.vectors @ own.vectors.T, 0.0)
        cosine = float(said.whole @ own.whole)
        new = new_back = 0.6 if not said.new and not own.new else 0.0
        if said.new and own.new:
            both = near[np.ix_(said.new, own.new)]
            new, new_back = float(both.max()), float(both.max(0).mean())
        about = 0.0
        for place in said.new:
            for word in sorted(lesson.fixtures):
                about = max(about, float(said.vectors[place] @ self.judge.table.vector(word)))
        return self.mask * np.array([
            cosine, float(said.rare_whole @ own.rare_whole),
            float((said.rare * near.max(1)).sum() / said.rare.sum()), float((own.rare * near.max(0)).sum() / own.rare.sum()),
            new, new_back, max((float(a @ b) for a in said.verbs for b in own.verbs), default=0.0),
            float(bool(said.fixtures & lesson.fixtures)), float(min(2, len(said.fixtures - lesson.fixtures))),
            cosine - said.seed_cosine, said.primitive,
            len(said.steps & lesson.steps) / max(1, len(said.steps | lesson.steps)), float(said.undone),
            math.log(1 + len(said.pieces)), about, 1.0,
        ])

    def score(self, said, lesson):
        if said.form == lesson.said.form:
            return 1.0
        return float(sigmoid(self.features(said, lesson) @ self.weights[lesson.kind]))

    def threshold(self, lesson, others):
        """Per lesson, from seeds and lessons alone: above what the seeds' variants and lessons with
        another program score, never below a half."""
        scores = [self.score(said, lesson) for said in others]
        return min(0.95, max([0.5, *scores]))


# ---------------------------------------------------------------- recordings
def rows(name):
    with gzip.open(SHARED / name, "rt") as file:
        return [json.loads(line) for line in file]


def share(text, parts):
    return int(hashlib.sha256(text.encode()).hexdigest(), 16) % parts


def held_out(row):
    return share(row["user"], 3) == 0


def fold(row):
    return share("fold" + row["user"], 4)


def plain(kind):
    return kind.replace("Sliced", "")


def manipulations(steps):
    return [plain(step) for step in steps if step.split()[0] in MANIPULATIONS]


def core(row):
    if row.get("core"):
        return plain(row["core"])
    kept = [step for step in row["prims"] if step.split()[0] not in ("OPEN", "CLOSE")]
    return plain((kept or row["prims"])[-1])


def room(scene):
    return "Kitchen" if scene <= 30 else "LivingRoom" if scene <= 230 else "Bedroom" if scene <= 330 else "Bathroom"


class Rooms:
    """Draws a scene: the things of the gold program among ten others of that room that share no name with them."""

    def __init__(self):
        shared = json.loads((SHARED / "alfred_objects_dev.json").read_text())["types"]
        self.in_room = collections.defaultdict(list)
        for kind in sorted(TYPES):
            for place in shared.get(kind, {}).get("rooms", []):
                self.in_room[place].append(kind)
        self.names = collections.defaultdict(set)
        for name, kinds in NAMES.items():
            for kind, count in kinds.items():
                if count >= 3:
                    self.names[kind].add(name)

    def scene(self, steps, scene, rng):
        gold = {plain(arg) for step in steps for arg in step.split()[1:]}
        taken = set().union(*(self.names[kind] for kind in gold))
        others = [kind for kind in self.in_room[room(scene)] if kind not in gold and not self.names[kind] & taken]
        return gold | set(rng.sample(others, min(10, len(others))))

    def moment(self, row, rng):
        """Where the gold program can start: what it puts down first is in the hand; the robot stands where it acts."""
        present = self.scene(row["prims"], row["scene"], rng)
        held = at = None
        if "goal" not in row:
            for step in row["prims"]:
                operator, *args = plain(step).split()
                if operator == "PICKUP":
                    break
                if operator == "PUT":
                    held = args[0]
                    break
            at = next((plain(step).split()[-1] for step in row["prims"] if step.split()[0] in ("PUT", "OPEN")), None)
        return lambda: Moment(present, held, at)


def labelled_clauses(some):
    out = []
    for row in some:
        clauses = cut(lift(row["u"]))
        if len(clauses) == 1:
            out.append((clauses[0], core(row).split()[0]))
            continue
        verbs = [main_verb(clause)[0] for clause in clauses]
        for clause, verb in zip(clauses, verbs):
            if verb in ("open", "close", "shut"):
                out.append((clause, "OPEN" if verb == "open" else "CLOSE"))
        if clauses and all(verb in ("open", "close", "shut", "go", "walk", "turn") for verb in verbs[:-1]):
            out.append((clauses[-1], core(row).split()[0]))
    return out


class Recordings:
    def __init__(self):
        good = [row for row in rows("alfred_utterances.jsonl.gz") if not row.get("suspect")]
        self.primitives = [row for row in good if row["prims"] and (
            row["act"] in ("PickupObject", "PutObject", "ToggleObject") or row["act"] == "GotoLocation" and row["ego"] is False)]
        self.slices = [row for row in good if row["act"] == "SliceObject"]
        self.taught = {act: [row for row in good if row["act"] == act and row["prims"]] for act in TAUGHT}
        tasks = {"pick_clean_then_place_in_recep": "clean", "pick_heat_then_place_in_recep": "heat",
                 "pick_cool_then_place_in_recep": "cool", "look_at_obj_in_light": "look"}
        self.goals = {name: [row for row in rows("alfred_goals.jsonl.gz") if row["task"] == task and row["expressible"]]
                      for task, name in tasks.items()}


def text_of(row):
    return row.get("goal") or row["u"]


# ---------------------------------------------------------------- learning and measuring
class Model:
    def __init__(self, recordings, choose, seed, off=(), never=None, real_unknown=False):
        """choose: which rows may be learned from; never: an action that the lesson judge must not see."""
        rng = random.Random(seed)
        self.off = off
        table = Table(ROOT / "crates/mind/data/words/default.words")
        labelled = labelled_clauses(row for row in recordings.primitives if choose(row))
        self.judge = PrimitiveJudge(table, Habits(labelled), off)
        untaught = [row for row in recordings.slices if choose(row)]
        if real_unknown:
            untaught += [row for act in TAUGHT for row in recordings.taught[act] if choose(row)]
        self.judge.learn(labelled, [cut(lift(row["u"])) for row in untaught], rng)
        self.calibration = self.judge.calibrate()
        self.lessons = LessonJudge(self.judge, off)
        groups = {}
        for name, some in [*recordings.taught.items(), *recordings.goals.items()]:
            pick = [row for row in some if choose(row)]
            if name != never:
                groups[name] = [(self.said(text_of(row)), row["prims"]) for row in rng.sample(pick, min(220, len(pick)))]
        some = [row for row in recordings.primitives if choose(row)]
        simple = [(self.said(row["u"]), None) for row in rng.sample(some, min(300, len(some)))]
        self.lessons_for(groups, simple, rng)
        self.variants = [self.said_lifted(text) for text, _ in SEEDS["variants"] + SEEDS["exemplars"]]

    def lessons_for(self, groups, simple, rng):
        for kind, names in (("request", TAUGHT), ("task", ("clean", "heat", "cool", "look"))):
            part = {name: groups[name] for name in names if name in groups}
            rows, answers = collect(self.lessons, part, simple, rng)
            self.lessons.weights[kind] = logistic(np.array(rows), np.array(answers), np.ones(len(rows))) * self.lessons.mask

    def said(self, text):
        return Said(lift(text), self.judge)

    def said_lifted(self, text):
        return Said(seed_pieces(text), self.judge)

    def read(self, text, moment):
        return read(cut(lift(text)), self.judge, moment)


def collect(judge, groups, simple, rng, lessons=90):
    rows, answers = [], []
    for name, members in groups.items():
        for said, program in rng.sample(members, min(lessons, len(members))):
            lesson = Lesson(said, program)
            for others, count, answer in [(members, 14, 1.0), *((o, 7, 0.0) for n, o in groups.items() if n != name), (simple, 12, 0.0)]:
                for other, _ in rng.sample(others, min(count, len(others))):
                    if other is not said:
                        rows.append(judge.features(other, lesson))
                        answers.append(answer)
    return rows, answers


def right(steps, gold):
    done = manipulations(steps)
    return done == [gold] if gold.split()[0] in MANIPULATIONS else not done and gold in steps


def measure_primitives(model, recordings, choose, rng, limit=3000):
    rooms, tally, by_action = Rooms(), collections.Counter(), collections.defaultdict(collections.Counter)
    some = [row for row in recordings.primitives if choose(row)]
    for row in rng.sample(some, min(limit, len(some))):
        steps, score = model.read(row["u"], rooms.moment(row, rng)())
        taken = bool(steps) and score >= model.judge.threshold
        kind = "not_sure" if not taken else "right" if right(steps, core(row)) else "wrong"
        tally[kind] += 1
        by_action[row["act"]][kind] += 1
    n = sum(tally.values())
    out = {kind: tally[kind] / n for kind in ("right", "wrong", "not_sure")}
    out["n"] = n
    some = [row for act in TAUGHT for row in recordings.taught[act] if choose(row)]
    taken = 0
    for row in some:
        steps, score = model.read(row["u"], rooms.moment(row, rng)())
        taken += bool(steps) and score >= model.judge.threshold
    out["untaught_accepted"] = taken / max(1, len(some))
    out["by_action"] = {act: {kind: round(count / sum(c.values()), 3) for kind, count in c.items()} for act, c in sorted(by_action.items())}
    return out


def fill(program, said_pieces, lesson_pieces, moment):
    """The lesson's program for another utterance: its thing and the place it names are replaced."""
    program = [plain(step) for step in program]
    things = [step.split()[1] for step in program if step.split()[0] in ("PICKUP", "PUT")]
    if not things:
        return None
    named = mentions(said_pieces)
    own = None
    thing = moment.held
    if not thing and not any(things[0] in mention.types for mention in mentions(lesson_pieces)):
        thing = things[0]  # the lesson does not name it: it stays what it was
    elif thing:
        own = next((i for i, mention in enumerate(named) if mention.pronoun or thing in mention.types), None)
    else:
        for place, mention in enumerate(named):
            kinds = [kind for kind in moment.meanings(mention) if kind in PICKUPABLE]
            if kinds:
                thing, own = kinds[0], place
                break
    if not thing:
        return None
    touched = {arg for step in program for arg in step.split()[1:]}
    lesson_types = {kind for mention in mentions(lesson_pieces) for kind in mention.types}
    last = max((i for i, step in enumerate(program) if step.startswith("PUT")), default=-1)
    final = manipulations(program)[-1].startswith("PUT") and program[last].split()[2] in lesson_types
    goal = program[last].split()[2] if last >= 0 else None
    kinds = [kind for i, mention in enumerate(named) if i != own for kind in moment.meanings(mention)[:1]]
    places = [kind for kind in kinds if kind in RECEPTACLE and kind != thing]
    place = next((kind for kind in places if kind not in touched or kind == goal), places[0] if places else None)
    lamp = next((kind for kind in kinds if kind in ("DeskLamp", "FloorLamp")), None)
    out = []
    for i, step in enumerate(program):
        operator, *args = [thing if word == things[0] else word for word in step.split()]
        if i == last and final:
            if not place:
                return None
            args[1] = place
        if lamp and args[-1] in ("DeskLamp", "FloorLamp"):
            args[-1] = lamp
        if operator in MANIPULATIONS and not set(args) <= moment.present:
            return None
        out.append(" ".join([operator, *args]))
    return out


def is_short(text):
    words = [token for token in tokens(text) if token not in ",.;:!"]
    return len(words) <= 10 and not {"and", "then", "while", "but", "or"} & set(words)


def measure_lessons(model, groups, primitives, choose, rng, episodes, others=100, failures=None):
    rooms = Rooms()
    groups = {name: [row for row in some if choose(row)] for name, some in groups.items()}
    primitives = [row for row in primitives if choose(row)]
    cache = {}

    def prepared(row):
        if row["id"] not in cache:
            cache[row["id"]] = (model.said(text_of(row)), lift(text_of(row)), rooms.moment(row, rng))
            moment = cache[row["id"]][2]()
            cache[row["id"]] += (read(cut(cache[row["id"]][1]), model.judge, moment),)
        return cache[row["id"]]

    results = collections.defaultdict(list)
    names = sorted(groups)
    for episode in range(episodes):
        name = names[episode % len(names)]
        people = collections.defaultdict(list)
        for row in groups[name]:
            people[row["user"]].append(row)
        able = sorted(person for person, own in people.items() if len(own) >= 3)
        if not able:
            continue
        person = rng.choice(able)
        taught = rng.choice(people[person])
        lesson_said, lesson_pieces, lesson_moment, _ = prepared(taught)
        lesson = Lesson(lesson_said, taught["prims"])
        threshold = model.lessons.threshold(lesson, model.variants)

        def answer(said, pieces, moment, reading):
            score = model.lessons.score(said, lesson)
            steps, sure = reading
            simple = bool(steps) and sure >= model.judge.threshold
            if score >= threshold and (not simple or score >= 0.7):
                return "lesson", fill(taught["prims"], pieces, lesson_pieces, moment()), score
            return ("primitives", steps, score) if simple else ("not sure", None, score)

        def good(row):
            kind, steps, score = answer(*prepared(row))
            ok = kind == "lesson" and steps is not None and manipulations(steps) == manipulations(row["prims"])
            if not ok and failures is not None:
                failures.append((name, text_of(taught), text_of(row), kind, round(score, 2)))
            return ok

        thing = next(plain(step).split()[1] for step in taught["prims"] if step.split()[0] in ("PUT", "PICKUP"))
        flag = {"C": "cleanable", "H": "heatable"}.get(name[0]) if name in TAUGHT else None
        flag = "coolable" if name == "CoolObject" else flag
        named = any(not mention.pronoun and thing in mention.types for mention in mentions(lesson_pieces))
        fits = [kind for kind in rooms.in_room[room(taught["scene"])]
                if kind in PICKUPABLE and kind != thing and (flag is None or flag in TYPES[kind]["flags"])]
        same = []
        for kind in rng.sample(fits, min(3, len(fits))) if named else []:
            word = max(NAMES, key=lambda key: (NAMES[key].get(kind, 0) / (1 + sum(NAMES[key].values())) * math.log(1 + NAMES[key].get(kind, 0)), key))
            text = " ".join(
                (" ".join(word) if isinstance(p, Mention) and not p.pronoun and thing in p.types else p.name if isinstance(p, Mention) else p)
                for p in lesson_pieces)
            before = lesson_moment()
            here = lambda: Moment(before.present - {thing} | {kind}, kind if before.held else None, before.at)
            pieces = lift(text)
            what, steps, _ = answer(Said(pieces, model.judge), pieces, here, ([], 0.0))
            want = [step.replace(thing, kind) for step in manipulations(taught["prims"])]
            same.append(what == "lesson" and steps is not None and manipulations(steps) == want)
            if not same[-1] and failures is not None:
                failures.append((name, "SAME " + text_of(taught), text, what, 0))
        own = [row for row in people[person] if row["id"] != taught["id"]]
        results["same_sentence"].append(same)
        results["same_person"].append([good(row) for row in rng.sample(own, min(20, len(own)))])
        pool = [row for row in groups[name] if row["user"] != person]
        pool = rng.sample(pool, min(others, len(pool)))
        marks = [good(row) for row in pool]
        results["others"].append(marks)
        results["others_short"].append([ok for ok, row in zip(marks, pool) if is_short(text_of(row))])
        pool = [row for other in names if other != name for row in rng.sample(groups[other], min(25, len(groups[other])))]
        marks = [answer(*prepared(row))[0] == "lesson" for row in pool]
        if failures is not None:
            failures += [(name, text_of(taught), "DISTRACTOR " + text_of(row), "lesson", 1) for ok, row in zip(marks, pool) if ok]
        results["distractors_accepted"].append(marks)
        results["distractors_short"].append([ok for ok, row in zip(marks, pool) if is_short(text_of(row))])
        pool = rng.sample(primitives, min(40, len(primitives)))
        got = [(row, answer(*prepared(row))) for row in pool]
        results["primitives_right"].append([kind == "primitives" and right(steps, core(row)) for row, (kind, steps, _) in got])
        results["primitives_as_lesson"].append([kind == "lesson" for _, (kind, _, _) in got])
    out = {}
    for key, lists in results.items():
        means = [float(np.mean(one)) for one in lists if one]
        out[key] = {"mean": round(float(np.mean(means)), 3), "sd": round(float(np.std(means)), 3), "n": len(means)}
    out["episodes"] = episodes
    return out


def report(model, recordings, choose, seed, limit, episodes):
    rng = random.Random(seed)
    print("calibration", {k: v if isinstance(v, list) else round(float(v), 3) for k, v in model.calibration.items()})
    found = measure_primitives(model, recordings, choose, rng, limit)
    print("primitives ", {k: round(v, 3) if isinstance(v, float) else v for k, v in found.items()})
    for title, groups in (("one-shot", recordings.taught), ("goals", recordings.goals)):
        found = measure_lessons(model, groups, recordings.primitives, choose, rng, episodes)
        print(f"{title:11}", " ".join(f"{k} {v['mean']:.3f}±{v['sd']:.2f}" for k, v in found.items() if k != "episodes"), flush=True)


# ---------------------------------------------------------------- writing
# Gained nothing measurable: the product has them not, so what is written is learned without.
LEFT_OUT = ("primitive", "steps_shared", "undone")
MARK = "# From here on written by tools/features.py: change the tool, not what follows."


def numbers(values):
    return "[" + ", ".join(f"{value:g}" for value in values) + "]"


def write(model):
    habits = model.judge.habits
    lines = ["# In how many clauses, of those that meant each primitive, a word stood. `V:` marks a clause's main verb, `_` its",
             "# particle, `n:` the number of things named. Written by tools/features.py from recorded sentences (NOTICE).",
             "", "order = " + json.dumps(PRIMITIVES), "clauses = " + numbers([habits.clauses[p] for p in PRIMITIVES]), "", "[words]"]
    lines += [f"{json.dumps(word)} = {numbers(row)}" for word, row in sorted(habits.counts.items())]
    (ROOT / "crates/household/data/habits.toml").write_text("\n".join(lines) + "\n")
    lines = ["[parser.features.primitive]"]
    lines += [f"{name} = {weight:.4f}" for name, weight in zip(PRIMITIVE_FEATURES, model.judge.weights)]
    for kind, weights in model.lessons.weights.items():
        lines += ["", f"[parser.features.lesson.{kind}]"]
        lines += [f"{name} = {weight:.4f}" for name, weight in zip(LESSON_FEATURES, weights) if name not in LEFT_OUT]
    lines += ["", "[abstraction.lists]"]
    for name, words in LISTS.items():
        text, row = [], "   "
        for word in words:
            if len(row) + len(word) + 4 > 100:
                text.append(row)
                row = "   "
            row += f' "{word}",'
        lines += [f"{name} = [", *text, row, "]"]
    recipe = ROOT / "crates/mind/data/recipes/default-1.toml"
    kept, mark, _ = recipe.read_text().partition(MARK)
    recipe.write_text(kept + mark + "\n\n" + "\n".join(lines) + "\n")
    print(f"wrote {len(habits.counts)} habits and {len(PRIMITIVE_FEATURES)} + 2 x {len(LESSON_FEATURES)} weights")


def main():
    parse = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parse.add_argument("--measure", choices=["folds", "final"])
    parse.add_argument("--fold", type=int, action="append", help="with --measure folds: only this one")
    parse.add_argument("--off", default="", help="features to switch off, with commas")
    parse.add_argument("--never", help="an action whose sentences the lesson judge must not learn from")
    parse.add_argument("--seed", type=int, default=1)
    parse.add_argument("--limit", type=int, default=3000)
    parse.add_argument("--episodes", type=int, default=24)
    args = parse.parse_args()
    off = [name for name in args.off.split(",") if name]
    recordings = Recordings()
    if args.measure == "folds":
        for number in args.fold or range(4):
            model = Model(recordings, lambda row: not held_out(row) and fold(row) != number, args.seed, off, args.never)
            print("fold", number, "off", off)
            print({n: round(float(w), 2) for n, w in zip(PRIMITIVE_FEATURES, model.judge.weights)})
            print({n: [round(float(w[i]), 2) for w in model.lessons.weights.values()] for i, n in enumerate(LESSON_FEATURES)})
            report(model, recordings, lambda row: not held_out(row) and fold(row) == number, args.seed, args.limit, args.episodes)
        return
    if not args.measure:
        off += LEFT_OUT
    model = Model(recordings, lambda row: not held_out(row), args.seed, off, args.never)
    if args.measure == "final":
        report(model, recordings, held_out, args.seed, args.limit, args.episodes)
        return
    write(model)


if __name__ == "__main__":
    main()
