"""Names of markers in the usual marker sets, by the landmark that a marker sits on."""

import functools
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
        """The landmark of a name in this set."""
        said = (plain, *(_phrases(plain) if self is GENERAL else ()))
        return next((landmark for landmark, names in self.names.items() if {*said} & {*names}), None)


def _words(**names: str) -> dict[str, tuple[str, ...]]:
    return {meaning: tuple(text.split()) for meaning, text in names.items()}


def _set(name: str, **names: str) -> MarkerSet:
    return MarkerSet(name, _words(**names))


# Names that mean something in one set only, or something else there. Sources: the sets' guides and examples;
# the centres that Plug-in Gait itself writes are the origins and ends of its bones (FEP, FEO, TIO).
SETS = (
    _set("Plug-in Gait / Helen Hayes",
        asis="asi", psis="psi", hip_centre="fep", knee_centre="feo", ankle_centre="tio", knee_lateral="kne",
        knee_medial="knm kneem", ankle_lateral="ank", ankle_medial="med", heel="hee",
        metatarsal_1="d1m fmh", metatarsal_2="toe smh", metatarsal_5="d5m vmh"),
    _set("OpenCap",
        asis="asisstudy", psis="psisstudy", hip_centre="hjcstudy", knee_lateral="kneestudy",
        knee_medial="mkneestudy", ankle_lateral="anklestudy", ankle_medial="manklestudy", heel="calcstudy",
        metatarsal_5="5metastudy", toe_tip="toestudy"),
    _set("video keypoints (BODY_25, HALPE_26)",
        hip_centre="hip", knee_centre="knee", ankle_centre="ankle", heel="heel", metatarsal_5="smalltoe",
        toe_tip="bigtoe"),
    _set("IOR / ISB / Human Body Model",
        knee_lateral="le", knee_medial="me", ankle_lateral="lm", ankle_medial="mm", heel="ca",
        metatarsal_1="fm", metatarsal_2="sm", metatarsal_5="vm"),
    _set("Visual3D",
        knee_lateral="lk", knee_medial="mk", ankle_lateral="la", ankle_medial="ma", heel="hl"),
)  # fmt: skip

# Words of names, English, French, German, Dutch, Italian, Spanish, by kind and by what they say. A name that
# holds these alone, one of a kind in any order, is a phrase: "Lat_Kne" says "knee-lateral".
_WORDS = {
    "place": _words(
        asis="asis asi ias sias eias", psis="psis psi ips sips eips", iliac="iliacspine spinailiaca waist",
        sacrum="sacrum sacr sacral sac s2 vsacral vsac vsacr midpsis mpsis", hip="hip", foot="foot",
        trochanter="trochanter troch gtroch gtro gtr gt tro ftc trocanter trocantere",
        knee="knee kne kn knie genou ginocchio rodilla", ankle="ankle ank enkel cheville caviglia tobillo",
        heel="heel heelfoot hee phe cal calc calcaneus calcaneum fcc hiel ferse talon tallone calcagno",
        metatarsal="mt mth mtp mp mh fm fmt met meta methead metatarsal metatarsalhead metatarse forefoot",
        toe="toe to toes hallux hlx hux bigtoe greattoe toetip zehe teen orteil alluce"),
    "bone": _words(
        condyle="condyle epicondyle femepi femoralepicondyle femurepicondyle femoralcondyle condilo",
        malleolus="malleolus mall mal malleole malleolo maleolo knochel knoechel"),
    "aspect": _words(
        lateral="lateral laterale lat l outer outside out ext externe externo esterno aussen buiten",
        medial="medial mediale med m inner inside in int interne interno innen binnen",
        front="anterior ant front", back="posterior post back"),
    "number": _words(**{"1": "1 1st first", "2": "2 2nd second", "5": "5 5th fifth"}),
    "centre": _words(centre="jc joint centre center jointcentre jointcenter"),
    "": _words(**{"": "marker great greater superior sup"}),
}  # fmt: skip


@functools.cache
def _phrases(text: str) -> tuple[str, ...]:
    """What the words of a name say, in each way to read them; nothing where a part of it is no word."""
    ways: list[tuple[str, dict[str, str]]] = [(text, {})]
    for rest, said in ways:
        for kind in _WORDS.keys() - said.keys():
            for meaning, words in _WORDS[kind].items():
                more = said | ({kind: meaning} if kind else {})
                ways += [(rest.removeprefix(word), more) for word in words if rest.startswith(word)]
    return tuple("-".join(said[kind] for kind in _WORDS if kind in said) for rest, said in ways if not rest)


# What means the same wherever it occurs: it completes every set.
GENERAL = _set("general names",
    asis="asis fwt iliac-front", psis="psis bwt iliac-back", sacrum="sacrum", trochanter="trochanter",
    hip_centre="hjc hip-centre", knee_centre="kjc knee-centre", ankle_centre="ajc ankle-centre",
    knee_lateral="knee knee-lateral condyle-lateral knee-condyle-lateral lfc lfe lek fle lepi lep lfemepi",
    knee_medial="knee-medial condyle-medial knee-condyle-medial mfc mfe mek fme mepi mep mfemepi",
    ankle_lateral="ankle ankle-lateral malleolus-lateral ankle-malleolus-lateral fal lma",
    ankle_medial="ankle-medial malleolus-medial ankle-malleolus-medial tam mma",
    heel="heel heel-back", metatarsal_1="metatarsal-1 toe-1 toe-medial foot-medial",
    metatarsal_2="metatarsal-2 toe-2", metatarsal_5="metatarsal-5 toe-5 toe-lateral foot-lateral",
    toe_tip="toe")  # fmt: skip
