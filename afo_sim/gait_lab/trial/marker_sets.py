"""Names of markers in the usual marker sets, by the landmark that a marker sits on."""

from collections.abc import Mapping
from dataclasses import dataclass

# {landmark: (which point of the leg it serves, where it is in words)}
LANDMARKS = {
    "asis": ("pelvis", "anterior superior iliac spine"),
    "psis": ("pelvis", "posterior superior iliac spine"),
    "sacrum": ("pelvis", "sacrum, midway between the posterior superior iliac spines"),
    "hip_centre": ("hip", "hip joint centre, computed by another program"),
    "trochanter": ("hip", "greater trochanter"),
    "knee_centre": ("knee", "knee joint centre, computed by another program"),
    "knee_lateral": ("knee", "lateral femoral epicondyle"),
    "knee_medial": ("knee", "medial femoral epicondyle"),
    "ankle_centre": ("ankle", "ankle joint centre, computed by another program"),
    "ankle_lateral": ("ankle", "lateral malleolus"),
    "ankle_medial": ("ankle", "medial malleolus"),
    "heel": ("heel", "back of the calcaneus"),
    "metatarsal_1": ("toe", "head of the first metatarsal"),
    "metatarsal_2": ("toe", "head of the second metatarsal, or between second and third"),
    "metatarsal_5": ("toe", "head of the fifth metatarsal"),
    "toe_tip": ("toe", "tip of the toes"),
}


@dataclass(frozen=True)
class MarkerSet:
    """Names of one set: landmark → names in lower case, without side and punctuation."""

    name: str
    names: Mapping[str, tuple[str, ...]]

    def meaning_of(self, plain: str) -> str | None:
        """The landmark that a name stands for in this set."""
        return next((landmark for landmark, names in self.names.items() if plain in names), None)


def _set(name: str, **names: str) -> MarkerSet:
    return MarkerSet(name, {landmark: tuple(text.split()) for landmark, text in names.items()})


# Sources: the sets' own guides and example files; the centres that Plug-in Gait itself writes are the
# origins and ends of its bones (FEP, FEO, TIO).
SETS = (
    _set("Plug-in Gait / Helen Hayes",
        asis="asi", psis="psi", sacrum="sacr sacrum", hip_centre="fep hjc", knee_centre="feo kjc",
        ankle_centre="tio ajc", knee_lateral="kne", knee_medial="knem knm mkne kneem", ankle_lateral="ank",
        ankle_medial="med ankm mank mma", heel="hee", metatarsal_1="d1m fmh", metatarsal_2="toe smh",
        metatarsal_5="d5m vmh", toe_tip="hlx hux"),
    _set("gait2354 / gait2392",
        asis="asis", sacrum="vsacral", knee_lateral="kneelat", knee_medial="kneemed",
        ankle_lateral="anklelat", ankle_medial="anklemed", heel="heel", metatarsal_1="toemed",
        metatarsal_5="toelat", toe_tip="toetip"),
    _set("Rajagopal model",
        asis="asi", psis="psi", hip_centre="hjc", knee_centre="kjc", ankle_centre="ajc", knee_lateral="lfc",
        knee_medial="mfc", ankle_lateral="lmal", ankle_medial="mmal", heel="cal", metatarsal_1="mt1",
        metatarsal_2="mt2", metatarsal_5="mt5", toe_tip="toe"),
    _set("OpenSim walking example",
        asis="asis", psis="psis", sacrum="s2", hip_centre="hjc", knee_centre="kneejoint",
        ankle_centre="anklejoint", knee_lateral="knee", knee_medial="mknee", ankle_lateral="ankle",
        ankle_medial="mankle", heel="heel", metatarsal_5="mt5", toe_tip="toe"),
    _set("OpenCap",
        asis="asisstudy", psis="psisstudy", hip_centre="hjcstudy", knee_lateral="kneestudy",
        knee_medial="mkneestudy", ankle_lateral="anklestudy", ankle_medial="manklestudy", heel="calcstudy",
        metatarsal_5="5metastudy", toe_tip="toestudy"),
    _set("video keypoints (BODY_25, HALPE_26)",
        hip_centre="hip", knee_centre="knee", ankle_centre="ankle", heel="heel", metatarsal_5="smalltoe",
        toe_tip="bigtoe"),
    _set("CAST",
        asis="ias", psis="ips", trochanter="ftc", knee_lateral="fle", knee_medial="fme", ankle_lateral="fal",
        ankle_medial="tam", heel="fcc", metatarsal_1="fm1 fmt1", metatarsal_2="fm2 fmt2",
        metatarsal_5="fm5 fmt5"),
    _set("IOR / ISB landmarks",
        asis="asis", psis="psis", trochanter="gt", knee_lateral="le", knee_medial="me", ankle_lateral="lm",
        ankle_medial="mm", heel="ca", metatarsal_1="fm", metatarsal_2="sm", metatarsal_5="vm"),
    _set("Human Body Model",
        asis="asis", psis="psis", sacrum="sacr", trochanter="gtro", knee_lateral="lek", knee_medial="mek",
        ankle_lateral="lm", ankle_medial="mm", heel="hee", metatarsal_5="mt5", toe_tip="toe"),
    _set("BMClab (Fukuchi)",
        asis="asis", psis="psis", trochanter="gtr", knee_lateral="knee", knee_medial="kneemedial",
        ankle_lateral="ankle", ankle_medial="anklemedial", heel="heel", metatarsal_1="mt1",
        metatarsal_2="mt2", metatarsal_5="mt5"),
    _set("Visual3D",
        asis="asis", psis="psis", trochanter="gt gtr", knee_lateral="lk", knee_medial="mk",
        ankle_lateral="la", ankle_medial="ma", heel="heel hl", metatarsal_1="1mt 1mh mt1 mh1",
        metatarsal_2="2mt 2mh mt2 mh2", metatarsal_5="5mt 5mh mt5 mh5"),
)  # fmt: skip


def _joint(words: str, sides: str) -> str:
    """Names that join a place and a side of it, in both orders: "kneelat", "latknee"."""
    return " ".join(
        f"{word}{side} {side}{word}"
        for word in words.split()
        for side in sides.split()
        if len(word + side) > 3
    )


def _metatarsal(number: str, ordinal: str, word: str) -> str:
    """Names of a metatarsal's head: "mt5", "5meta", "5thmet", "fifthmetatarsal"."""
    bones = ("mt", "mth", "mtp", "mh", "met", "meta", "methead", "metatarsal", "metatarsalhead")
    counted = [f"{count}{bone}" for bone in bones for count in (number, ordinal, word)]
    return " ".join([*counted, *(f"{bone}{number}" for bone in bones)])


_KNEE = "knee kne epicondyle femoralepicondyle femurepicondyle femepi condyle femoralcondyle"
_ANKLE = "ankle ank malleolus mall mal"
_LATERAL, _MEDIAL = "lateral lat l outer outside ext", "medial med m inner inside int"

# Names that mean the same wherever they occur; they complete every set.
GENERAL = _set(
    "general names",
    asis="asis asi ias anteriorsuperioriliacspine",
    psis="psis psi ips posteriorsuperioriliacspine",
    sacrum="sacrum sacr sacral vsacral vsac vsacr s2 midpsis mpsis",
    hip_centre="hjc hipjc hipcentre hipcenter hipjoint hipjointcentre hipjointcenter",
    trochanter="gtro gtr gtroch gtrochanter troch trochanter greattrochanter greatertrochanter tro ftc",
    knee_centre="kjc kneejc kneecentre kneecenter kneejoint kneejointcentre kneejointcenter",
    knee_lateral=_joint(_KNEE, _LATERAL) + " lfc lfe lek fle lepi lfemepi lepicondyle latfemcondyle knee kne",
    knee_medial=_joint(_KNEE, _MEDIAL) + " mfc mfe mek fme mepi mfemepi mepicondyle medfemcondyle",
    ankle_centre="ajc anklejc anklecentre anklecenter anklejoint anklejointcentre anklejointcenter",
    ankle_lateral=_joint(_ANKLE, _LATERAL) + " lmal fal lmall lmalleolus ankle ank",
    ankle_medial=_joint(_ANKLE, _MEDIAL) + " mmal tam mmall mmalleolus",
    heel="heel hee cal calc calcaneus fcc heelback posteriorheel postheel",
    metatarsal_1=_metatarsal("1", "1st", "first") + " footmed",
    metatarsal_2=_metatarsal("2", "2nd", "second"),
    metatarsal_5=_metatarsal("5", "5th", "fifth") + " footlat",
    toe_tip="toe toetip hallux bigtoe toes hlx hux",
)
