#!/usr/bin/env python3
"""Checks a proof of apprentice. A second reader: it shares no code with the first.

    python3 verify.py FILE --key KEY [--since OLD_CHECKPOINT]

Needs Python 3.9 and the package cryptography. schema/proof.md describes every byte.
Exit codes: 0 everything holds; 1 something does not; 2 a file or the key cannot be read.
"""
import argparse, base64, hashlib, re, struct, sys, unicodedata, zlib
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

class Refused(Exception):  # it does not hold: 1
    pass

class Unreadable(Exception):  # it cannot be read: 2
    pass

def need(holds, sentence, kind=Refused):
    if not holds:
        raise kind(sentence)

def plain(text):
    """One line: what cannot be seen, ends a line or drives a terminal is written as \\u{202e}."""
    hidden = ("Cc", "Cf", "Cn", "Cs", "Zl", "Zp")
    return "".join("\\u{%x}" % ord(c) if unicodedata.category(c) in hidden else c for c in text)

# --- BLAKE3, for records and commitments -------------------------------------------------------
IV = struct.unpack(">8I", bytes.fromhex(
    "6a09e667bb67ae853c6ef372a54ff53a510e527f9b05688c1f83d9ab5be0cd19"))
ORDER = (2, 6, 3, 10, 7, 0, 4, 13, 1, 11, 12, 5, 9, 14, 15, 8)
LANES = ((0, 4, 8, 12), (1, 5, 9, 13), (2, 6, 10, 14), (3, 7, 11, 15),
         (0, 5, 10, 15), (1, 6, 11, 12), (2, 7, 8, 13), (3, 4, 9, 14))

def compress(chain, block, counter, flags):
    words = struct.unpack("<16I", block.ljust(64, b"\0"))
    v = [*chain, *IV[:4], counter & 0xffffffff, counter >> 32, len(block), flags]
    for _ in range(7):
        for lane, (a, b, c, d) in enumerate(LANES):
            for word, first, second in ((words[2 * lane], 16, 12), (words[2 * lane + 1], 8, 7)):
                v[a] = (v[a] + v[b] + word) & 0xffffffff
                x = v[d] ^ v[a]
                v[d] = (x >> first | x << (32 - first)) & 0xffffffff
                v[c] = (v[c] + v[d]) & 0xffffffff
                x = v[b] ^ v[c]
                v[b] = (x >> second | x << (32 - second)) & 0xffffffff
        words = [words[place] for place in ORDER]
    return [v[i] ^ v[i + 8] for i in range(8)]

def blake3(data, chunk=0, root=8):
    if len(data) > 1024:
        left = 1024 << ((len(data) - 1) // 1024).bit_length() - 1
        sides = [blake3(data[:left], chunk, 0), blake3(data[left:], chunk + left // 1024, 0)]
        return struct.pack("<8I", *compress(IV, b"".join(sides), 0, 4 | root))
    chain = IV
    for at in range(0, max(len(data), 1), 64):
        flags = (at == 0) | (2 | root if at + 64 >= len(data) else 0)
        chain = compress(chain, data[at:at + 64], chunk, flags)
    return struct.pack("<8I", *chain)

# --- Merkle trees (RFC 6962, 9162) ------------------------------------------------------------
def leaf(data):
    return hashlib.sha256(b"\0" + data).digest()

def node(left, right):
    return hashlib.sha256(b"\1" + left + right).digest()

def climb(place, last, path, olds, news):
    """Both roots that a path leads to; None when it is too short or too long."""
    for beside in path:
        if last == 0:
            return None
        if place & 1 or place == last:
            olds, news = node(beside, olds), node(beside, news)
            while not place & 1 and place:
                place, last = place >> 1, last >> 1
        else:
            news = node(news, beside)
        place, last = place >> 1, last >> 1
    return (olds, news) if last == 0 else None

def consistent(old, old_root, new, new_root, path):
    if old == 0 or old == new:
        empty = hashlib.sha256(b"").digest()
        return not path and old_root == (empty if old == 0 else new_root)
    place, last = old - 1, new - 1
    while place & 1:
        place, last = place >> 1, last >> 1
    if old & (old - 1):
        start, path = (path[0], path[1:]) if path else (b"", [])
    else:
        start = old_root
    return climb(place, last, path, start, start) == (old_root, new_root)

# --- texts -------------------------------------------------------------------------------------
def unbase64(text, length=None, kind=Unreadable):
    try:
        data = base64.b64decode(text, validate=True)
    except ValueError:
        data = None
    plain = data is not None and base64.b64encode(data).decode() == text
    need(plain and length in (None, len(data)), "a word is not the base64 it should be", kind)
    return data

def number(text, kind=Unreadable):
    plain = re.fullmatch("0|[1-9][0-9]{0,19}", text) and int(text) < 1 << 64
    need(plain, "a word is not the number it should be", kind)
    return int(text)

def unhex(text, length):
    need(re.fullmatch("[0-9a-f]{%d}" % (2 * length), text), "no hexadecimal digits", Unreadable)
    return bytes.fromhex(text)

def public_key(text):
    name, digits, key = (text.split("+", 2) + ["", ""])[:3]
    data = unbase64(key, 33)
    tag = hashlib.sha256(name.encode() + b"\n" + data).digest()[:4]
    need(name and data[0] == 1 and digits == tag.hex(), "it is not a public key", Unreadable)
    return name, tag, Ed25519PublicKey.from_public_bytes(data[1:])

def checkpoint(note, key):
    """Size and root, once the key's signature was checked."""
    name, tag, public = key
    need("\n\n" in note and note.endswith("\n"), "it is not a signed note")
    need(not re.search("[\0-\t\v-\x1f\x7f]", note), "it holds control characters")
    text, signatures = note.rsplit("\n\n", 1)
    text, signatures, found = text + "\n", signatures[:-1].split("\n"), False
    need(len(signatures) <= 64, "too many signatures")
    for line in signatures:
        match = re.fullmatch("\u2014 ([!-*,-~]{1,255}) ([A-Za-z0-9+/=]+)", line)
        need(match, "a line is not a signature")
        signature = unbase64(match[2], kind=Refused)
        need(len(signature) > 4, "a signature is too short")
        if match[1] == name and signature[:4] == tag:
            try:
                public.verify(signature[4:], text.encode())
                found = True
            except InvalidSignature:
                raise Refused("the signature does not match the note") from None
    need(found, "the note has no signature by " + name)
    lines = text[:-1].split("\n")
    need(len(lines) >= 3 and all(lines), "it is not a checkpoint")
    need(lines[0] == name, "it is a checkpoint of another log")
    return number(lines[1], Refused), unbase64(lines[2], 32, Refused)

# --- the proof ---------------------------------------------------------------------------------
def read_proof(text):
    """What the lines say, by name, and the checkpoint."""
    need(text.startswith("apprentice proof 1\n") and "\n\n" in text, "it is not a proof", Unreadable)
    head, note = text.split("\n\n", 1)
    order = ["record", "revealed", "segment", "segment-path", "leaf", "tree-path", "since"]
    found = {}
    for line in head.split("\n")[1:]:
        name, *words = line.split(" ")
        need(name in order, "a line is unknown or in the wrong place", Unreadable)
        order = order[order.index(name) + 1:]
        found[name] = words
    record = {"record", "segment", "segment-path", "leaf", "tree-path"} & found.keys()
    need(found and len(record) in (0, 5) and (record or "revealed" not in found), "lines are missing", Unreadable)
    for name, count in (("record", 1), ("revealed", 2), ("segment", 4), ("leaf", 1)):
        need(name not in found or len(found[name]) == count, "a line has too many or too few words", Unreadable)
    if "since" in found:
        found["older"] = number((found["since"] + [""])[0])
        del found["since"][:1]
    for name in ("segment-path", "tree-path", "since"):
        found[name] = [unbase64(word, 32) for word in found.get(name, [])]
        need(len(found[name]) <= 65, "a path is too long", Unreadable)
    if record:
        stream, first, last, digest = found["segment"]
        found["segment"] = unhex(stream, 16), number(first), number(last), unhex(digest, 32)
        need(found["segment"][1] and found["segment"][2], "a sequence number is 0", Unreadable)
        found["record"], found["leaf"] = unbase64(found["record"][0]), number(found["leaf"][0])
    if "revealed" in found:
        found["revealed"] = unbase64(found["revealed"][0], 32) + unbase64(found["revealed"][1])
    return found, note

def check_record(found, size, root):
    frame, (stream, first, last, head) = found["record"], found["segment"]
    need(len(frame) >= 128 and frame[:4] == b"APR1", "it is not a record")
    length, checksum = struct.unpack(">II", frame[120:128])
    need(length == len(frame) - 128 and checksum == zlib.crc32(frame[128:], zlib.crc32(frame[:124])),
         "the record is not as it was written")
    seq, digest = struct.unpack(">Q", frame[20:28])[0], blake3(frame)
    need(frame[4:20] == stream and seq and first <= seq <= last, "the record is not in the segment")
    need(seq != last or digest == head, "the record is not the segment's head")
    inner = climb(seq - first, last - first, found["segment-path"], b"", leaf(digest))
    need(inner, "the path in the segment does not fit")
    data = b"APS1" + stream + struct.pack(">QQ", first, last) + inner[1] + head
    outer = found["leaf"] < size and climb(found["leaf"], size - 1, found["tree-path"], b"", leaf(data))
    need(outer, "the path in the tree does not fit")
    need(outer[1] == root, "this is not the record that was in the log")
    need("revealed" not in found or blake3(found["revealed"]) == frame[84:116], "salt and body are not the record's")
    return "record %d of stream %s (digest %s)" % (seq, stream.hex(), digest.hex())

def check(data, key_text, since):
    key = public_key(key_text.strip())
    try:
        found, note = read_proof(data.decode())
    except UnicodeDecodeError:
        raise Unreadable("it is not text") from None
    size, root = checkpoint(note, key)
    shown = [check_record(found, size, root)] if "record" in found else []
    if since is not None:
        old, old_root = checkpoint(since.decode(errors="replace"), key)
        need(old <= size, "the log was rolled back: %d segments, then %d" % (old, size))
        said = found.get("older") == old
        need(said or old in (0, size), "the file does not say how the log grew")
        path = found["since"] if said else []
        need(consistent(old, old_root, size, root, path), "the log was forked")
        shown.append("the log only grew, from %d segments" % old)
    return shown + ["checkpoint of %s: %d segments" % (key[0], size)]

def main():
    parser = argparse.ArgumentParser(description="Checks a proof of apprentice.")
    parser.add_argument("file")
    parser.add_argument("--key", required=True, help="the log's public key, or a file that holds it")
    parser.add_argument("--since", help="a checkpoint that was kept from earlier")
    arguments = parser.parse_args()
    try:
        read = lambda path: open(path, "rb").read()
        key = arguments.key if "+" in arguments.key else read(arguments.key).decode()
        since = read(arguments.since) if arguments.since else None
        print("\n".join(map(plain, check(read(arguments.file), key, since))))
        return 0
    except Refused as refused:
        print("verify.py: not proved:", plain(str(refused)), file=sys.stderr)
        return 1
    except (Unreadable, OSError, ValueError) as error:
        print("verify.py: cannot be read:", plain(str(error)), file=sys.stderr)
        return 2

if __name__ == "__main__":
    sys.exit(main())
