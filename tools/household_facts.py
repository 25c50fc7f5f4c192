#!/usr/bin/env python3
"""Derives crates/household/data/{types,rooms,names,tasks}.toml from recorded household facts (ALFRED json_2.1.0).

Run by hand; the output is committed:

    python3 tools/household_facts.py PATH_TO_SHARED_DATA crates/household/data

Reads alfred_objects_dev.json, alfred_scenes.json and alfred_tasks.jsonl of the given folder. Only facts and single
names are taken over, never a sentence. What we add or correct by hand stands in the tables below.
"""

import collections
import json
import pathlib
import sys

# Recorded types that are parts or doubles of others, or that nobody can act on or point at.
LEFT_OUT = {
    "Bathtub", "Sink", "Lamp", "StoveKnob", "PaperTowel", "ToiletPaperRoll", "LaundryHamperLid",
    "ShowerGlass", "Blinds", "Boots",
}
# Anything that can be carried may be put on these (a person who repairs a mistake needs somewhere
# to put things down); the recorded containment says what is usual.
SURFACES = {"CounterTop", "DiningTable", "CoffeeTable", "SideTable", "Desk", "Dresser"}
# The recorded flags know only the lamps, and no plan ever turned on a television.
TOGGLEABLE = {
    "Faucet", "Microwave", "DeskLamp", "FloorLamp", "CoffeeMachine", "Toaster", "StoveBurner",
    "Television", "LightSwitch",
}
OPENABLE = {"Box", "Cabinet", "Drawer", "Fridge", "Microwave", "Safe", "Laptop"}
# Of what opens, these stand open unless something closes them: nobody opens a box to fill it.
USUALLY_OPEN = {"Box", "Laptop"}
# Seen in recorded plans, against the recorded containment.
ALSO_GOES_IN = {
    "Knife": ["Fridge", "Microwave", "Cabinet", "GarbageCan"],
    "ButterKnife": ["Fridge", "Microwave", "Cabinet", "GarbageCan"],
    "CD": ["ArmChair"], "Glassbottle": ["GarbageCan"],
    "TeddyBear": ["ArmChair", "Bed", "Desk", "Dresser", "Shelf", "Sofa"],
    "ScrubBrush": ["Cabinet", "Cart", "CounterTop"],
}
# Fixed things that stand on or at another fixed thing, and what that may be.
STANDS_ON = {
    "Faucet": ["SinkBasin", "BathtubBasin"],
    "DeskLamp": ["Desk", "SideTable", "Dresser", "DiningTable", "CoffeeTable", "Shelf"],
    "Television": ["TVStand", "Dresser", "SideTable", "CoffeeTable", "DiningTable"],
    "CoffeeMachine": ["CounterTop", "DiningTable", "SideTable"],
    "Toaster": ["CounterTop", "DiningTable", "SideTable"],
    "Microwave": ["CounterTop", "DiningTable", "SideTable", "Cabinet"],
    "SinkBasin": ["CounterTop"],
    "StoveBurner": ["CounterTop"],
    "HousePlant": ["CounterTop", "DiningTable", "CoffeeTable", "SideTable", "Desk", "Dresser"],
}
# Stand in the middle of a room, not along its walls.
CENTRAL = {"DiningTable", "CoffeeTable", "Ottoman", "Chair", "Footstool"}
# One puts things "in" these and "on" all other receptacles.
INSIDE = {"BathtubBasin", "Bowl", "Box", "Cabinet", "Cup", "Drawer", "Fridge", "GarbageCan",
          "LaundryHamper", "Microwave", "Mug", "Pan", "Pot", "Safe", "SinkBasin"}
ROOMS = ["Kitchen", "LivingRoom", "Bedroom", "Bathroom"]
ROOM_KEY = {"Kitchen": "kitchen", "LivingRoom": "living_room", "Bedroom": "bedroom",
            "Bathroom": "bathroom"}
# Recorded scenes count every burner and every drawer; more than this only makes numbers to type.
CAP = {"Cabinet": 6, "Drawer": 5, "SinkBasin": 1, "StoveBurner": 2, "Shelf": 4, "SideTable": 2,
       "HandTowelHolder": 2, "BathtubBasin": 1, "Bed": 1, "CounterTop": 3, "TVStand": 1,
       "Sofa": 1, "Toilet": 1}
# Recorded only as present, without a place.
ALSO_PRESENT = {"Toaster", "Faucet", "FloorLamp", "DeskLamp", "Television", "LightSwitch",
                "HousePlant", "Chair", "Window", "Mirror", "Painting", "LaundryHamper",
                "TowelHolder", "CoffeeMachine", "ShowerDoor", "ShowerCurtain", "ShowerHead",
                "Poster", "Curtains", "PaperTowelRoll"}

TASK_FORMS = {
    "look_at_obj_in_light": "look", "pick_and_place_simple": "place",
    "pick_and_place_with_movable_recep": "nested", "pick_two_obj_and_place": "two",
    "pick_clean_then_place_in_recep": "clean", "pick_heat_then_place_in_recep": "heat",
    "pick_cool_then_place_in_recep": "cool",
}
FORM_PARTS = {
    "look": ["object", "toggle"], "place": ["object", "parent"], "two": ["object", "parent"],
    "nested": ["object", "mrecep", "parent"], "clean": ["object", "parent"],
    "heat": ["object", "parent"], "cool": ["object", "parent"],
}

# Names that were said while looking at a thing, and are not its name.
NOT_ITS_NAME = {
    "AlarmClock": ["container"],
    "ArmChair": ["credit card", "remote", "arm", "chair's cushion", "chairs cushion"],
    "BathtubBasin": ["sink", "bar of soap"],
    "Bed": ["laptop", "pillow", "book", "phone"],
    "Cabinet": ["sink", "salt", "soap", "salt shaker", "candle", "mug", "counter", "hand cabinet"],
    "Cart": ["bottle", "sink"],
    "Cloth": ["cloth wet", "wash cloth wet", "clothing", "clothes"],
    "CoffeeMachine": ["spout", "coffee makers spout", "coffee maker's spout"],
    "CoffeeTable": ["vase", "laptop", "credit card"],
    "CounterTop": ["toaster", "knife", "coffee maker", "tomato", "bread", "table", "stove"],
    "CreditCard": ["credit"],
    "Cup": ["wine glasses", "glasses", "butter knife"],
    "Desk": ["cd", "laptop", "pencil"],
    "DiningTable": ["chair", "bread", "loaf of bread", "apple", "salt shaker", "lettuce"],
    "DishSponge": ["sponge wet", "object"],
    "Drawer": ["cell phone", "counter", "ladle", "sink"],
    "Dresser": ["credit card", "tv", "tv's base"],
    "Fridge": ["tomato", "knife", "lettuce", "microwave", "apple", "plate"],
    "GarbageCan": ["toilet"],
    "KeyChain": ["of car keys"],
    "Lettuce": ["melon"],
    "Microwave": ["plate", "apple", "mug", "egg"],
    "Mug": ["heat", "measuring cup"],
    "Ottoman": ["phone", "chair", "remote"],
    "Pan": ["spoon", "stack"],
    "Plate": ["spatula", "place", "items", "frying pan"],
    "Pot": ["deep"],
    "Potato": ["fruit", "peach", "cookie", "apple", "egg", "potato take", "put"],
    "SaltShaker": [],
    "Shelf": ["salt shaker", "mug", "roll", "plate", "counter", "cabinet", "self", "radiator cover",
              "shelves top shelf", "bench"],
    "SideTable": ["microwave", "shelves", "lamp", "spoon", "low work table"],
    "SinkBasin": ["plate", "sponge", "egg", "counter", "drain"],
    "SoapBar": ["soap wet", "bar of soap wet", "sponge", "towel"],
    "Sofa": ["newspaper", "laptop", "box"],
    "Toilet": ["roll", "sink", "bottle", "flusher", "lid", "toilet tank lid"],
    "ToiletPaper": ["cup"],
    "ToiletPaperHanger": ["plunger"],
    "Tomato": ["apple", "heat", "half of tomato"],
    "Vase": ["lid"],
    "WateringCan": [],
}
# Sensible names beside the typical ones: rarer in the recordings, or for types nobody named.
ALSO_CALLED = {
    "AlarmClock": ["digital clock", "clock radio"],
    "ArmChair": ["armchair", "recliner", "lounge chair", "easy chair", "chair cushion",
                 "seat cushion"],
    "BaseballBat": [],
    "BasketBall": ["basket ball"],
    "BathtubBasin": ["bath", "tub basin", "bathtub basin", "shower tub"],
    "Bed": ["mattress", "bunk bed"],
    "Book": ["geometry book", "notebook", "novel"],
    "Bowl": ["cereal bowl"],
    "Box": ["carton", "cardboard carton"],
    "Bread": ["bread loaf", "loaf bread", "toast"],
    "ButterKnife": ["table knife", "dinner knife", "silver knife", "butterknife"],
    "CD": ["compact disc", "compact disk"],
    "Cabinet": ["cabinet door", "cupboard door", "kitchen cabinet", "vanity cabinet", "cubby",
                "sink cabinet"],
    "Candle": ["wax candle"],
    "Cart": ["cart", "cleaning cart", "trolley"],
    "CellPhone": ["cellphone", "mobile phone", "mobile", "iphone", "i phone", "telephone"],
    "Cloth": ["napkin", "towelette", "dish rag", "dish cloth", "dishcloth", "dishrag", "face cloth"],
    "CoffeeMachine": ["coffeemaker", "coffee brewer", "keurig", "espresso machine"],
    "CoffeeTable": ["center table", "living room coffee table"],
    "CounterTop": ["countertop", "counter top", "kitchen counter top", "kitchen countertop",
                   "island", "worktop", "work top", "bathroom counter", "bathroom counter top",
                   "vanity", "bathroom vanity", "counter space", "sink counter", "kitchen island"],
    "CreditCard": ["debit card", "bank card"],
    "Cup": ["drinking glass", "water glass", "champagne glass", "champagne flute", "glass cup",
            "wineglass", "chalice"],
    "Desk": ["computer desk", "desktop", "desk top", "writing desk", "work desk"],
    "DeskLamp": ["lamp light", "reading lamp", "desk light", "table light", "bedside lamp",
                 "desklamp", "small lamp"],
    "DiningTable": ["dining room table", "dinner table", "table top", "tabletop", "breakfast table"],
    "DishSponge": ["dish sponge", "scrubber", "scrub pad"],
    "Drawer": ["desk drawer", "dresser drawer", "cabinet drawer", "nightstand drawer"],
    "Dresser": ["bureau", "chest of drawers", "entertainment center", "entertainment stand",
                "tv cabinet", "tv table", "tv console", "media console", "sideboard", "credenza",
                "buffet", "dresser top", "drawers"],
    "Egg": [],
    "Faucet": ["faucet", "tap", "water", "water faucet", "sink faucet", "water tap", "spigot",
               "faucet water", "sink water"],
    "FloorLamp": ["standing lamp", "floor light", "standing light", "tall lamp", "floorlamp",
                  "pole lamp", "living room lamp"],
    "Fork": ["dinner fork"],
    "Fridge": ["fridge door", "refrigerator door", "ice box", "icebox", "fridge shelf"],
    "GarbageCan": ["waste bin", "dustbin", "dust bin", "rubbish", "waste paper basket", "recycling",
                   "waste can", "wastebin", "trashbin", "rubbish can", "recycle can"],
    "Glassbottle": ["glass bottle", "glass vase", "carafe", "decanter"],
    "HandTowel": ["handtowel", "wash cloth"],
    "HandTowelHolder": ["towel rack", "towel holder", "towel bar", "hand towel holder",
                        "hand towel rack", "towel ring", "towel hanger", "towel hook"],
    "Kettle": ["teakettle", "coffee kettle"],
    "KeyChain": ["keychain", "key", "car key", "pair of keys", "bunch of keys", "keyring",
                 "set of car keys"],
    "Knife": ["kitchen knife", "steak knife", "carving knife", "paring knife", "chef knife",
              "chefs knife", "cutting knife"],
    "Ladle": ["serving spoon", "big spoon", "soup ladle"],
    "Laptop": ["laptop computer", "notebook computer", "lap top computer", "pc"],
    "LaundryHamper": ["laundry hamper", "hamper", "laundry basket", "clothes hamper"],
    "Lettuce": ["lettuce head", "head of cabbage", "iceberg lettuce", "cabbage head",
                "head of iceberg lettuce", "salad"],
    "Microwave": ["microwave oven", "microwave door", "oven"],
    "Mug": ["tea cup", "teacup", "coffeecup", "beer mug"],
    "Newspaper": ["news paper", "paper"],
    "Ottoman": ["footstool", "footrest", "stool", "pouf"],
    "Pan": ["fryer pan", "fryingpan", "sauce pan", "grilling pan", "broiling pan", "cooking pan",
            "frypan"],
    "Pen": ["ink pen", "ballpoint pen"],
    "Pencil": [],
    "PepperShaker": ["pepper", "pepper mill", "peppermill", "pepper pot", "salt bottle",
                     "pepper bottle"],
    "Pillow": ["throw pillow", "plaid cushion", "bolster"],
    "Plate": ["saucer", "platter", "baking pan", "dinner plate"],
    "Pot": ["sauce pan", "cooking pot", "stock pot", "sauce pot", "soup pot"],
    "Potato": ["spud", "vegetable"],
    "RemoteControl": ["tv remote", "television remote", "wand", "controller", "tv control",
                      "tv remote control", "control wand", "clicker"],
    "Safe": ["safe door", "strongbox"],
    "SaltShaker": ["salt grinder", "salt mill", "pepper grinder", "salt bottle", "salt container"],
    "Shelf": ["bookshelf", "bookcase", "book case", "shelving", "shelving unit", "wall shelf"],
    "SideTable": ["bedside table", "bed side table", "night table", "bed table", "small table",
                  "bedside stand", "accent table", "black table", "work table", "television stand"],
    "SinkBasin": ["basin", "bathroom sink", "hand sink", "wash basin", "washbasin", "sinkbasin"],
    "SoapBar": ["bar soap"],
    "SoapBottle": ["soap bottle", "hand soap", "dish soap", "soap pump", "liquid soap",
                   "hand soap bottle", "lotion dispenser", "shampoo", "shampoo bottle"],
    "Sofa": ["loveseat", "love seat", "settee", "leather sofa", "seat cushion", "sofa cushion"],
    "Spatula": ["slotted spatula", "flipper"],
    "Spoon": ["teaspoon", "tablespoon", "table spoon", "tea spoon"],
    "SprayBottle": ["spray", "cleaning spray", "spray cleaner", "cleaning bottle", "cleaner bottle",
                    "glass cleaner", "bottle of spray", "windex"],
    "Statue": ["sculpture", "figure", "human figurine statue", "statuette", "bust"],
    "StoveBurner": ["stove top", "stovetop", "range", "oven", "stove burner", "hob", "cooktop",
                    "cook top", "gas burner"],
    "TVStand": ["tv stand", "television stand", "tv table", "tv console", "tv cabinet",
                "entertainment center", "entertainment stand"],
    "TennisRacket": ["tennis racquet", "tennis raquet"],
    "TissueBox": ["kleenex box", "box of kleenex", "kleenex", "tissue", "tissue paper box"],
    "Toilet": ["toilet cover", "commode", "back of the toilet", "toilet bowl", "toilet lid"],
    "ToiletPaper": ["toilet tissue", "cardboard roll", "toilet tissue roll", "roll of paper",
                    "bathroom tissue", "empty roll", "toilet paper tube"],
    "ToiletPaperHanger": ["hanger", "toilet paper roll holder", "toilet paper hanger",
                          "toilet roll holder", "paper holder", "toilet paper rack"],
    "Vase": ["urn", "pottery", "pot", "glass vase"],
    "Watch": ["wristwatch"],
    "WateringCan": ["watering pot", "water can", "watering jug", "teapot"],
    "WineBottle": ["wine bottle", "bottle of alcohol", "liquor bottle"],
    # Things to walk to or to point at.
    "Chair": ["chair", "dining chair", "wooden chair", "stool", "bar stool", "barstool"],
    "Curtains": ["curtain", "drape"],
    "Footstool": ["footstool", "foot stool", "step stool", "stool"],
    "HousePlant": ["plant", "house plant", "houseplant", "potted plant", "flower", "flower pot"],
    "LightSwitch": ["light switch", "switch", "lightswitch"],
    "Mirror": ["mirror"],
    "Painting": ["painting", "picture", "picture frame"],
    "PaperTowelRoll": ["paper towel", "paper towel roll", "roll of paper towels",
                       "roll of paper towel"],
    "Poster": ["poster"],
    "ScrubBrush": ["scrub brush", "toilet brush", "brush", "toilet scrubber"],
    "ShowerCurtain": ["shower curtain"],
    "ShowerDoor": ["shower door", "shower", "shower stall"],
    "ShowerHead": ["shower head", "showerhead"],
    "TeddyBear": ["teddy bear", "teddy", "stuffed bear", "bear", "stuffed animal"],
    "Television": ["tv", "television", "tv set", "television set", "tv screen", "t v"],
    "Toaster": ["toaster"],
    "Towel": ["towel", "bath towel", "big towel"],
    "TowelHolder": ["towel holder", "towel rack", "towel bar"],
    "Window": ["window", "window sill", "windowsill"],
}
# "Turn on the sink" means its faucet; the count keeps the basin ahead for everything else. Who puts
# something on the edge of a sink means the counter, but only when no sink is there to be meant.
COUNTED = {("CounterTop", "sink"): 30, ("Faucet", "sink"): 20, ("Faucet", "faucet"): 66, ("Faucet", "tap"): 14,
           ("Faucet", "water"): 60, ("Chair", "chair"): 20, ("Television", "tv"): 20,
           ("HandTowelHolder", "towel rack"): 5, ("Faucet", "kitchen sink"): 1}


def main(shared, out):
    objects = json.loads((shared / "alfred_objects_dev.json").read_text())["types"]
    scenes = json.loads((shared / "alfred_scenes.json").read_text())["scenes"]
    kinds = {name: facts for name, facts in objects.items() if name not in LEFT_OUT}
    write_types(kinds, out / "types.toml")
    write_rooms(kinds, scenes, out / "rooms.toml")
    write_names(kinds, out / "names.toml")
    write_tasks(kinds, shared / "alfred_tasks.jsonl", out / "tasks.toml")


def head(what):
    return (f"# {what}\n# Written by tools/household_facts.py from ALFRED json_2.1.0 facts"
            " (NOTICE); change the tool, not this file.\n")


def quoted(items):
    return "[" + ", ".join(f'"{item}"' for item in items) + "]"


def write_types(kinds, path):
    """One table per type. `number` is what digests hash: never reused, new types come last."""
    previous = {}
    if path.exists():
        name = None
        for line in path.read_text().splitlines():
            if line.startswith("["):
                name = line.strip("[]")
            elif line.startswith("number"):
                previous[name] = int(line.split("=")[1])
    after = max(previous.values(), default=0)
    lines = [head("What kinds of things there are, what they can do, and where they usually go.")]
    for name in sorted(kinds):
        facts = kinds[name]
        if name not in previous:
            after += 1
            previous[name] = after
        pickable = facts["pickupable"] or name in ("Towel", "TeddyBear", "ScrubBrush")
        flags = [
            ("pickupable", pickable),
            ("receptacle", facts["receptacle"] and name != "Toaster"),
            ("surface", name in SURFACES),
            ("inside", name in INSIDE),
            ("central", name in CENTRAL),
            ("openable", name in OPENABLE),
            ("usually_open", name in USUALLY_OPEN),
            ("toggleable", name in TOGGLEABLE),
            ("light", facts.get("goal_light", False)),
            ("heatable", facts["heatable"]),
            ("coolable", facts["coolable"]),
            ("cleanable", facts["cleanable"]),
        ]
        lines.append(f"[{name}]")
        lines.append(f"number = {previous[name]}")
        lines.append(f"flags = {quoted(flag for flag, holds in flags if holds)}")
        goes_in = [place for place in facts.get("may_be_put_in") or [] if place in kinds]
        goes_in += ALSO_GOES_IN.get(name, [])
        if goes_in:
            lines.append(f"goes_in = {quoted(goes_in)}")
        if name in STANDS_ON:
            lines.append(f"stands_on = {quoted(STANDS_ON[name])}")
        lines.append("")
    path.write_text("\n".join(lines))


def write_rooms(kinds, scenes, path):
    """Per room and type: in how many of the recorded scenes it is, how many there are (quartiles),
    and on or in what it was recorded, with counts."""
    lines = [head("What stands where in the four rooms.")]
    for room in ROOMS:
        here = [scene for scene in scenes if scene["room"] == room]
        widths = sorted(round(100 * (s["bounds"][2] - s["bounds"][0])) for s in here)
        depths = sorted(round(100 * (s["bounds"][3] - s["bounds"][1])) for s in here)
        middle = len(here) // 2
        key = ROOM_KEY[room]
        lines.append(f"[{key}]")
        lines.append(f"scenes = {len(here)}")
        # The recorded bounds are of the floor the robot can reach; furniture stands around it.
        lines.append(f"size_cm = [{widths[middle] + 150}, {depths[middle] + 150}]")
        lines.append("")
        counts = collections.defaultdict(list)
        places = collections.defaultdict(collections.Counter)
        for scene in here:
            found = collections.Counter()
            for thing in scene["receptacles"] + scene["objects"]:
                if thing["type"] in kinds:
                    found[thing["type"]] += 1
            for name in scene["types_present"]:
                if name in ALSO_PRESENT and name in kinds and name not in found:
                    found[name] = 1
            for name, count in found.items():
                counts[name].append(min(count, CAP.get(name, 3)))
            for thing in scene["objects"]:
                parent = thing.get("parent", thing.get("parent_guess"))
                if parent is None or thing["type"] not in kinds:
                    continue
                place = next(r["type"] for r in scene["receptacles"] if r["i"] == parent)
                if place in (kinds[thing["type"]].get("may_be_put_in") or []):
                    places[thing["type"]][place] += 1
        for name in sorted(counts):
            few = sorted(counts[name])
            low, high = few[len(few) // 4], few[(3 * len(few)) // 4]
            lines.append(f"[{key}.things.{name}]")
            lines.append(f"in_scenes = {len(few)}")
            lines.append(f"count = [{low}, {high}]")
            if places[name]:
                each = ", ".join(f"{p} = {n}" for p, n in sorted(places[name].items()))
                lines.append(f"places = {{ {each} }}")
            lines.append("")
    path.write_text("\n".join(lines))


def write_names(kinds, path):
    """From a name to the types it may mean, with how often recorded people used it so; names
    added by hand count once. A name that is typical of one type also means another when it was used
    so three times, and both can be carried or neither can: the rest names what stands nearby."""
    names = collections.defaultdict(dict)
    for kind, facts in kinds.items():
        recorded = dict((name, count) for name, count in facts.get("names") or [])
        dropped = NOT_ITS_NAME.get(kind, [])
        for name in facts.get("typical_names") or []:
            if name not in dropped:
                names[name][kind] = recorded.get(name, 1)
        for name in ALSO_CALLED.get(kind, []):
            names[name].setdefault(kind, recorded.get(name, 1))
    for kind, facts in kinds.items():
        for name, count in facts.get("names") or []:
            alike = any(kinds[other]["pickupable"] == facts["pickupable"]
                        for other in names.get(name, {}))
            if alike and count >= 3 and name not in NOT_ITS_NAME.get(kind, []):
                names[name].setdefault(kind, count)
    for (kind, name), count in COUNTED.items():
        names[name][kind] = count
    lines = [head("What people call things: name = { type = how often }.")]
    for name in sorted(names):
        meant = sorted(names[name].items(), key=lambda item: (-item[1], item[0]))
        lines.append(f'"{name}" = {{ ' + ", ".join(f"{k} = {n}" for k, n in meant) + " }")
    lines.append("")
    path.write_text("\n".join(lines))


def write_tasks(kinds, recorded, path):
    """The recorded combinations of task, things and room, without those that need slicing."""
    found = collections.defaultdict(lambda: collections.defaultdict(set))
    for line in recorded.read_text().splitlines():
        task = json.loads(line)
        form = TASK_FORMS[task["task_type"]]
        things = [task[part] for part in FORM_PARTS[form]]
        if not task["sliced"] and all(thing in kinds for thing in things):
            found[ROOM_KEY[task["room"]]][form].add(" ".join([form] + things))
    lines = [head("Tasks that make sense, by room and form.")]
    for room in ROOM_KEY.values():
        for form in sorted(found[room]):
            lines.append(f"[{room}.{form}]\ntasks = [")
            lines += [f'    "{task}",' for task in sorted(found[room][form])]
            lines.append("]\n")
    path.write_text("\n".join(lines))


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
