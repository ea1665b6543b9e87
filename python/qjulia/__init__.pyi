import os
from dataclasses import dataclass
from typing import (
    Any,
    Callable,
    Dict,
    List,
    Literal,
    Mapping,
    NamedTuple,
    Optional,
    Protocol,
    Sequence,
    SupportsIndex,
    Tuple,
    TypedDict,
    Union,
    overload,
)

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "BufferField",
    "Comparison",
    "Device",
    "DeviceError",
    "DeviceInfo",
    "Energy",
    "Error",
    "Fit",
    "FitResult",
    "InputError",
    "KernelBuildError",
    "Map",
    "MorphResult",
    "NoDeviceError",
    "OptionError",
    "OutputError",
    "StageReport",
    "Surface",
    "__version__",
    "compare",
    "devices",
    "doctor",
    "fit",
    "load",
    "looks",
    "morph",
    "profile",
    "profile_launch",
    "quadratic_map",
    "read_mesh",
    "render",
    "run",
    "sample_surface",
    "save_png",
    "shape",
    "signed_distance",
    "tune",
    "with_versor_of",
]

__version__: str

_Path = Union[str, os.PathLike[str]]
_Up = Literal["auto", "x", "y", "z", "-x", "-y", "-z"]
_Detail = Union[float, Literal["auto", "smooth", "clear", "wild"]]
_Precision = Literal["single", "double"]
_Space = Literal["shape", "map"]
_Device = Union["Device", str, None]
_Progress = Optional[Callable[[str, float, float, str], object]]
_Doubles = NDArray[np.float64]
_Singles = NDArray[np.float32]
_Bytes = NDArray[np.uint8]
_Weights = Callable[[_Doubles], ArrayLike]
_Loss = Union[Literal["distance", "tanh"], Callable[[_Doubles], Tuple[ArrayLike, ArrayLike]]]

class _WithFaces(Protocol):
    @property
    def vertices(self) -> Any: ...
    @property
    def faces(self) -> Any: ...

class _WithCells(Protocol):
    @property
    def points(self) -> Any: ...
    @property
    def cells_dict(self) -> Any: ...

_Mesh = Union[Tuple[ArrayLike, ArrayLike], _WithFaces, _WithCells, _Path]

class Error(Exception): ...
class InputError(Error, ValueError): ...
class OptionError(InputError): ...
class OutputError(Error, OSError): ...
class NoDeviceError(Error, RuntimeError): ...
class DeviceError(Error, RuntimeError): ...
class KernelBuildError(Error, RuntimeError): ...

class DeviceInfo(TypedDict):
    id: str
    kind: str
    name: str
    vendor: str
    platform: str
    driver: str
    opencl: str
    compute_units: int
    clock_mhz: int
    native_float_lanes: int
    global_memory: int
    largest_allocation: int
    local_memory: int
    largest_work_group: int
    double_precision: bool
    shares_memory: bool
    draws_screen: bool
    pci_address: Optional[str]
    uuid: Optional[str]
    estimated_speed: float
    rank: int
    same_as: Optional[str]
    layout: str

class Device:
    def __init__(self, name: str = ..., *, layout: str = ..., tuned: bool = ...) -> None: ...
    @classmethod
    def from_opencl(cls, queue: Any) -> Device: ...
    @property
    def name(self) -> str: ...
    @property
    def info(self) -> DeviceInfo: ...
    @property
    def layout(self) -> str: ...

def devices() -> List[DeviceInfo]: ...

class Surface(NamedTuple):
    vertices: _Doubles
    faces: NDArray[np.uint32]
    normals: _Singles
    def save(
        self,
        path: _Path,
        *,
        up: Optional[_Up] = ...,
        colors: Optional[ArrayLike] = ...,
        map: Optional[Map] = ...,
    ) -> None: ...

@overload
def read_mesh(path: _Path, *, return_index: Literal[False] = ...) -> Surface: ...
@overload
def read_mesh(
    path: _Path, *, return_index: Literal[True]
) -> Tuple[Surface, NDArray[np.int64]]: ...
def signed_distance(
    mesh: _Mesh, points: ArrayLike, *, device: _Device = ..., precision: _Precision = ...
) -> _Doubles: ...
def sample_surface(
    mesh: _Mesh, count: SupportsIndex, *, seed: int = ...
) -> Tuple[_Doubles, _Doubles]: ...

class Map:
    def __init__(self, *_: Any, **__: Any) -> None: ...
    @classmethod
    def load(cls, path: _Path) -> Map: ...
    def save(self, path: _Path) -> None: ...
    @classmethod
    def from_json(cls, text: str) -> Map: ...
    def to_json(self) -> str: ...
    @property
    def factors(self) -> NDArray[np.void]: ...
    def with_factors(
        self,
        factors: ArrayLike,
        *,
        log_scale: Optional[float] = ...,
        surface_level: Optional[float] = ...,
        calibrate: bool = ...,
        device: _Device = ...,
    ) -> Map: ...
    def calibrated(self, *, device: _Device = ...) -> Map: ...
    def with_knobs(
        self,
        *,
        device: _Device = ...,
        # knob_table
        detail: Optional[_Detail] = ...,
        order_seed: Optional[SupportsIndex] = ...,
        phase: Optional[ArrayLike] = ...,
        slice: Optional[float] = ...,
        rotate: Optional[ArrayLike] = ...,
        drift: Optional[float] = ...,
        translate: Optional[ArrayLike] = ...,
        scale: Optional[float] = ...,
        steepness: Optional[float] = ...,
        # end of knob_table
    ) -> Map: ...
    @overload
    def field(
        self,
        points: ArrayLike,
        *,
        device: _Device = ...,
        n: SupportsIndex = ...,
        gradient: Literal[False] = ...,
        space: _Space = ...,
        precision: _Precision = ...,
        escape: Optional[float] = ...,
    ) -> _Doubles: ...
    @overload
    def field(
        self,
        points: ArrayLike,
        *,
        gradient: Literal[True],
        device: _Device = ...,
        n: SupportsIndex = ...,
        space: _Space = ...,
        precision: _Precision = ...,
        escape: Optional[float] = ...,
    ) -> Tuple[_Doubles, _Doubles]: ...
    def versors(
        self,
        points: ArrayLike,
        *,
        device: _Device = ...,
        space: _Space = ...,
        precision: _Precision = ...,
    ) -> _Doubles: ...
    def images(
        self,
        points: ArrayLike,
        *,
        device: _Device = ...,
        n: SupportsIndex = ...,
        space: _Space = ...,
        precision: _Precision = ...,
        escape: Optional[float] = ...,
    ) -> _Doubles: ...
    def orbits(
        self,
        points: ArrayLike,
        *,
        device: _Device = ...,
        n: SupportsIndex = ...,
        space: _Space = ...,
        precision: _Precision = ...,
        escape: Optional[float] = ...,
    ) -> _Doubles: ...
    def escape_counts(
        self,
        points: ArrayLike,
        *,
        device: _Device = ...,
        n: SupportsIndex = ...,
        space: _Space = ...,
        precision: _Precision = ...,
        escape: Optional[float] = ...,
    ) -> NDArray[np.int32]: ...
    def sample(
        self,
        resolution: SupportsIndex = ...,
        *,
        device: _Device = ...,
        on_progress: _Progress = ...,
        # sample_settings
        n: SupportsIndex = ...,
        box: Optional[ArrayLike] = ...,
        escape: Optional[float] = ...,
        precision: Literal["single", "double"] = ...,
        # end of sample_settings
    ) -> Tuple[NDArray[np.floating[Any]], _Doubles]: ...
    def surface(
        self,
        resolution: SupportsIndex = ...,
        *,
        device: _Device = ...,
        on_progress: _Progress = ...,
        # surface_settings
        refine: Optional[SupportsIndex] = ...,
        exact: bool = ...,
        dense: bool = ...,
        n: SupportsIndex = ...,
        box: Optional[ArrayLike] = ...,
        escape: Optional[float] = ...,
        precision: Literal["single", "double"] = ...,
        # end of surface_settings
        # print_settings
        height: Optional[float] = ...,
        longest: Optional[float] = ...,
        max_triangles: Optional[SupportsIndex] = ...,
        max_error: Optional[float] = ...,
        min_wall: Optional[float] = ...,
        flat_foot: Optional[float] = ...,
        shell: Optional[float] = ...,
        drain: float = ...,
        # end of print_settings
        # selection_settings
        cut: Union[str, Mapping[str, Union[float, str]]] = ...,
        keep_loose: bool = ...,
        largest_component: bool = ...,
        min_component: Optional[float] = ...,
        # end of selection_settings
    ) -> Surface: ...
    def surface_colors(
        self,
        mesh: _Mesh,
        *,
        device: _Device = ...,
        on_progress: _Progress = ...,
        material: Literal["iterations", "trap", "groove", "height", "factor"] = ...,
        palette: Union[str, Sequence[str], None] = ...,
        range: Optional[ArrayLike] = ...,
        n: SupportsIndex = ...,
        escape: Optional[float] = ...,
        precision: _Precision = ...,
    ) -> NDArray[np.uint8]: ...
    def paint(
        self,
        mesh: Optional[_Mesh] = ...,
        shares: Optional[ArrayLike] = ...,
        *,
        device: _Device = ...,
        on_progress: _Progress = ...,
        balls: Optional[ArrayLike] = ...,
        blocks: Optional[ArrayLike] = ...,
        ramp: Optional[Tuple[Literal["x", "y", "z"], float, float]] = ...,
        # paint_settings
        thickness: Optional[float] = ...,
        elsewhere: float = ...,
        # end of paint_settings
    ) -> Map: ...
    def portals(
        self,
        count: SupportsIndex = ...,
        *,
        device: _Device = ...,
        on_progress: _Progress = ...,
        # portal_settings
        size: float = ...,
        mask: Literal["none", "outside", "inside"] = ...,
        # end of portal_settings
    ) -> Map: ...
    def with_roughness(
        self,
        mesh: Optional[_Mesh] = ...,
        faces: Optional[ArrayLike] = ...,
        *,
        device: _Device = ...,
        on_progress: _Progress = ...,
        # target_settings
        target_area: Optional[float] = ...,
        target_dimension: Optional[float] = ...,
        target_volume: Optional[float] = ...,
        target_resolution: SupportsIndex = ...,
        # end of target_settings
    ) -> Map: ...
    def without_paint(self) -> Map: ...
    def without_portals(self) -> Map: ...
    @property
    def provenance(self) -> Dict[str, Any]: ...
    def with_provenance(self, provenance: Dict[str, Any]) -> Map: ...
    @property
    def kind(self) -> str: ...
    @property
    def degree(self) -> float: ...
    @property
    def log_scale(self) -> float: ...
    @property
    def surface_level(self) -> float: ...
    @property
    def slice(self) -> float: ...
    @property
    def phase(self) -> _Doubles: ...
    @property
    def detail(self) -> Optional[float]: ...
    @property
    def steepness(self) -> float: ...
    @property
    def diagonal(self) -> Optional[float]: ...
    @property
    def inradius(self) -> Optional[float]: ...
    @property
    def up(self) -> Optional[str]: ...
    @property
    def box(self) -> Optional[_Doubles]: ...
    @property
    def is_painted(self) -> bool: ...
    @property
    def portal_count(self) -> int: ...
    def to_map(self, points: ArrayLike) -> _Doubles: ...
    def to_shape(self, points: ArrayLike) -> _Doubles: ...
    def __copy__(self) -> Map: ...
    def __deepcopy__(self, memo: Any) -> Map: ...
    def __eq__(self, other: object) -> bool: ...
    def __hash__(self) -> int: ...
    def __reduce__(self) -> Tuple[Callable[[str], Map], Tuple[str]]: ...
    def _repr_png_(self) -> bytes: ...

def load(path: _Path) -> Map: ...
def quadratic_map(c: ArrayLike) -> Map: ...
@overload
def render(
    subject: Union[Map, _Mesh],
    *,
    layers: Literal[False] = ...,
    framed: Union[ArrayLike, Map, None] = ...,
    device: _Device = ...,
    on_progress: _Progress = ...,
    # picture_settings
    n: SupportsIndex = ...,
    box: Optional[ArrayLike] = ...,
    escape: Optional[float] = ...,
    precision: Literal["single", "double"] = ...,
    cut: Union[str, Mapping[str, Union[float, str]]] = ...,
    keep_loose: bool = ...,
    exact: bool = ...,
    size: Tuple[int, int] = ...,
    samples: SupportsIndex = ...,
    bits: SupportsIndex = ...,
    azimuth: float = ...,
    elevation: float = ...,
    zoom: float = ...,
    look_at: Optional[ArrayLike] = ...,
    distance: Optional[float] = ...,
    frame: Optional[ArrayLike] = ...,
    field_of_view: float = ...,
    aperture: float = ...,
    focus: Optional[ArrayLike] = ...,
    up: Optional[_Up] = ...,
    look: str = ...,
    material: Literal["clay", "iterations", "trap", "groove", "height", "factor"] = ...,
    palette: Union[str, Sequence[str]] = ...,
    range: Optional[ArrayLike] = ...,
    ground: bool = ...,
    background: str = ...,
    light: Literal["studio", "rim", "low-key", "noon", "dusk", "museum"] = ...,
    lamp: Union[str, Sequence[Any]] = ...,
    lamp_turn: Optional[float] = ...,
    fill: Optional[float] = ...,
    fill_color: Optional[str] = ...,
    environment: str = ...,
    environment_turn: float = ...,
    bounce: float = ...,
    exposure: Union[float, Literal["auto"], None] = ...,
    tone: Literal["neutral", "agx", "aces", "none"] = ...,
    roughness: float = ...,
    metal: float = ...,
    coat: float = ...,
    sheen: float = ...,
    wax: float = ...,
    glow: float = ...,
    glow_from: float = ...,
    glow_full: float = ...,
    fog: float = ...,
    # end of picture_settings
) -> _Bytes: ...
@overload
def render(
    subject: Map,
    *,
    layers: Literal[True],
    device: _Device = ...,
    on_progress: _Progress = ...,
    # picture_settings
    n: SupportsIndex = ...,
    box: Optional[ArrayLike] = ...,
    escape: Optional[float] = ...,
    precision: Literal["single", "double"] = ...,
    cut: Union[str, Mapping[str, Union[float, str]]] = ...,
    keep_loose: bool = ...,
    exact: bool = ...,
    size: Tuple[int, int] = ...,
    samples: SupportsIndex = ...,
    bits: SupportsIndex = ...,
    azimuth: float = ...,
    elevation: float = ...,
    zoom: float = ...,
    look_at: Optional[ArrayLike] = ...,
    distance: Optional[float] = ...,
    frame: Optional[ArrayLike] = ...,
    field_of_view: float = ...,
    aperture: float = ...,
    focus: Optional[ArrayLike] = ...,
    up: Optional[_Up] = ...,
    look: str = ...,
    material: Literal["clay", "iterations", "trap", "groove", "height", "factor"] = ...,
    palette: Union[str, Sequence[str]] = ...,
    range: Optional[ArrayLike] = ...,
    ground: bool = ...,
    background: str = ...,
    light: Literal["studio", "rim", "low-key", "noon", "dusk", "museum"] = ...,
    lamp: Union[str, Sequence[Any]] = ...,
    lamp_turn: Optional[float] = ...,
    fill: Optional[float] = ...,
    fill_color: Optional[str] = ...,
    environment: str = ...,
    environment_turn: float = ...,
    bounce: float = ...,
    exposure: Union[float, Literal["auto"], None] = ...,
    tone: Literal["neutral", "agx", "aces", "none"] = ...,
    roughness: float = ...,
    metal: float = ...,
    coat: float = ...,
    sheen: float = ...,
    wax: float = ...,
    glow: float = ...,
    glow_from: float = ...,
    glow_full: float = ...,
    fog: float = ...,
    # end of picture_settings
) -> Tuple[_Bytes, Dict[str, _Singles]]: ...
def looks() -> Dict[str, str]: ...
def save_png(image: _Bytes, path: _Path, *, map: Optional[Map] = ...) -> None: ...
class _Figures(TypedDict):
    n: int
    iou: float
    mean_distance: float
    distance_95: float
    hausdorff_distance: float
    energy: float
    roughness: float
    slope_variation: float

class Comparison(_Figures, total=False):
    limbs: int
    limbs_kept: int

@overload
def compare(
    map: Map,
    mesh: _Mesh,
    faces: None = ...,
    *,
    n: Union[SupportsIndex, Sequence[SupportsIndex]] = ...,
    device: _Device = ...,
    on_progress: _Progress = ...,
    # compare_settings
    resolution: SupportsIndex = ...,
    limbs: bool = ...,
    box: Optional[ArrayLike] = ...,
    escape: Optional[float] = ...,
    precision: Literal["single", "double"] = ...,
    # end of compare_settings
) -> List[Comparison]: ...
@overload
def compare(
    map: Map,
    mesh: ArrayLike,
    faces: ArrayLike,
    *,
    n: Union[SupportsIndex, Sequence[SupportsIndex]] = ...,
    device: _Device = ...,
    on_progress: _Progress = ...,
    # compare_settings
    resolution: SupportsIndex = ...,
    limbs: bool = ...,
    box: Optional[ArrayLike] = ...,
    escape: Optional[float] = ...,
    precision: Literal["single", "double"] = ...,
    # end of compare_settings
) -> List[Comparison]: ...
def run(
    job: Union[_Path, Dict[str, Any]],
    output: Optional[_Path] = ...,
    *,
    changes: Optional[Dict[str, Any]] = ...,
    inputs: Optional[_Path] = ...,
    device: _Device = ...,
    on_progress: _Progress = ...,
) -> Optional[Dict[str, Any]]: ...
@dataclass(frozen=True)
class StageReport:
    name: str
    evaluations: int
    energy_before: float
    energy_after: float
    seconds: float
    iou: float
    n: int
    map: Optional[Map] = ...

@dataclass(frozen=True)
class FitResult:
    map: Map
    stopped: str
    evaluations: int
    seconds: float
    mean_distance: float
    stages: List[StageReport]
    warnings: List[str]
    summary: str

def fit(
    vertices: Union[_Mesh, ArrayLike],
    faces: Optional[ArrayLike] = ...,
    *,
    device: _Device = ...,
    on_stage: Optional[Callable[[StageReport], object]] = ...,
    on_evaluation: Optional[Callable[[float], object]] = ...,
    on_progress: _Progress = ...,
    # fit_settings
    factors: Union[SupportsIndex, Literal["auto"], None] = ...,
    max_factors: Optional[SupportsIndex] = ...,
    detail: _Detail = ...,
    steepness: float = ...,
    up: Optional[_Up] = ...,
    time_limit: Optional[float] = ...,
    target_iou: Optional[float] = ...,
    max_evaluations: Optional[SupportsIndex] = ...,
    seed: SupportsIndex = ...,
    schedule: str = ...,
    polish: bool = ...,
    unknowns: Literal["exponents", "all"] = ...,
    placement: Literal["depth", "paper"] = ...,
    sample_parts: Optional[SupportsIndex] = ...,
    precision: Literal["single", "double"] = ...,
    # end of fit_settings
    schedule_text: str = ...,
    initial: Optional[Map] = ...,
    weights: Optional[_Weights] = ...,
    checkpoint: Optional[_Path] = ...,
    resume: bool = ...,
) -> FitResult: ...

class Fit:
    def __init__(
        self,
        vertices: Union[_Mesh, ArrayLike],
        faces: Optional[ArrayLike] = ...,
        *,
        device: _Device = ...,
        on_evaluation: Optional[Callable[[float], object]] = ...,
        on_progress: _Progress = ...,
        # fit_settings
        factors: Union[SupportsIndex, Literal["auto"], None] = ...,
        max_factors: Optional[SupportsIndex] = ...,
        detail: _Detail = ...,
        steepness: float = ...,
        up: Optional[_Up] = ...,
        time_limit: Optional[float] = ...,
        target_iou: Optional[float] = ...,
        max_evaluations: Optional[SupportsIndex] = ...,
        seed: SupportsIndex = ...,
        schedule: str = ...,
        polish: bool = ...,
        unknowns: Literal["exponents", "all"] = ...,
        placement: Literal["depth", "paper"] = ...,
        sample_parts: Optional[SupportsIndex] = ...,
        precision: Literal["single", "double"] = ...,
        # end of fit_settings
        schedule_text: str = ...,
        initial: Optional[Map] = ...,
        weights: Optional[_Weights] = ...,
        checkpoint: Optional[_Path] = ...,
        resume: bool = ...,
    ) -> None: ...
    def step(self) -> Optional[StageReport]: ...
    def __iter__(self) -> Fit: ...
    def __next__(self) -> StageReport: ...
    @property
    def map(self) -> Map: ...
    @property
    def stages(self) -> List[StageReport]: ...
    @property
    def stopped(self) -> Optional[str]: ...
    def result(self) -> FitResult: ...

def shape(
    vertices: Union[_Mesh, ArrayLike],
    faces: Optional[ArrayLike] = ...,
    *,
    versor: Union[Literal["random", "noise", "noise4"], Map, None] = ...,
    device: _Device = ...,
    on_progress: _Progress = ...,
    roots: int = ...,
    octaves: int = ...,
    scale: float = ...,
    seed: int = ...,
    # exact_settings
    resolution: SupportsIndex = ...,
    detail: _Detail = ...,
    steepness: float = ...,
    up: Optional[_Up] = ...,
    fourth: Literal["round", "ignored"] = ...,
    # end of exact_settings
    thickness: Optional[float] = ...,
    phase: Optional[ArrayLike] = ...,
) -> Map: ...

@dataclass(frozen=True)
class MorphResult:
    maps: List[Map]
    factors: Dict[str, int]
    flicker: Optional[Dict[str, float]]

def morph(
    a: Map,
    b: Map,
    steps: SupportsIndex = ...,
    *,
    device: _Device = ...,
    on_progress: _Progress = ...,
    # morph_settings
    flicker_cells: SupportsIndex = ...,
    # end of morph_settings
) -> MorphResult: ...
def with_versor_of(map: Map, other: Map, *, device: _Device = ...) -> Map: ...

class Energy:
    def __init__(
        self,
        map: Map,
        points: ArrayLike,
        *,
        device: _Device = ...,
        sides: Optional[ArrayLike] = ...,
        weights: Optional[ArrayLike] = ...,
        targets: Optional[ArrayLike] = ...,
        loss: _Loss = ...,
        alpha: float = ...,
        n: SupportsIndex = ...,
        slice: bool = ...,
        space: _Space = ...,
        escape: Optional[float] = ...,
        precision: _Precision = ...,
    ) -> None: ...
    @property
    def size(self) -> int: ...
    @property
    def x0(self) -> _Doubles: ...
    def value(self, x: ArrayLike) -> float: ...
    def value_and_gradient(self, x: ArrayLike) -> Tuple[float, _Doubles]: ...
    def field(self, x: ArrayLike) -> _Doubles: ...
    def map_at(self, x: ArrayLike) -> Map: ...
def profile(
    map: Optional[Map] = ...,
    mesh: Optional[_Mesh] = ...,
    faces: Optional[ArrayLike] = ...,
    *,
    jobs: Union[str, Sequence[str]] = ...,
    kernels: Union[str, Sequence[str]] = ...,
    host_name: bool = ...,
    device: _Device = ...,
    on_progress: _Progress = ...,
    # profile_settings
    sample_points: SupportsIndex = ...,
    factors: SupportsIndex = ...,
    repeats: SupportsIndex = ...,
    seed: SupportsIndex = ...,
    lane_width: Optional[SupportsIndex] = ...,
    n: Optional[SupportsIndex] = ...,
    time_limit: Optional[float] = ...,
    counters: bool = ...,
    precision: Literal["single", "double"] = ...,
    # end of profile_settings
) -> Dict[str, Any]: ...
def tune(
    map: Optional[Map] = ...,
    mesh: Optional[_Mesh] = ...,
    faces: Optional[ArrayLike] = ...,
    *,
    keep: bool = ...,
    host_name: bool = ...,
    device: _Device = ...,
    on_progress: _Progress = ...,
    # tune_settings
    sample_points: SupportsIndex = ...,
    factors: SupportsIndex = ...,
    repeats: SupportsIndex = ...,
    seed: SupportsIndex = ...,
    precision: Literal["single", "double"] = ...,
    # end of tune_settings
) -> Dict[str, Any]: ...
def doctor(
    *,
    programs: Union[str, Sequence[str]] = ...,
    device: _Device = ...,
    on_progress: _Progress = ...,
) -> Dict[str, Any]: ...
def profile_launch(
    kernel: str,
    run: Callable[[], object],
    *,
    device: _Device = ...,
    slots: float = ...,
    bytes: float = ...,
    at_most: bool = ...,
    precision: _Precision = ...,
    repeats: SupportsIndex = ...,
) -> Dict[str, Any]: ...
class BufferField:
    def __init__(
        self,
        map: Map,
        *,
        device: Device,
        precision: _Precision = ...,
        escape: Optional[float] = ...,
    ) -> None: ...
    def stride(self, count: SupportsIndex) -> int: ...
    def at(
        self, points: Any, count: SupportsIndex, field: Any, *, n: SupportsIndex = ...
    ) -> None: ...
    def gradient_at(self, points: Any, count: SupportsIndex, gradient: Any) -> None: ...
