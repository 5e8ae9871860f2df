/* Embree beside matdb: takes a turn of building and tracing for every line on stdin.
 *
 *     embree low|medium plain|robust coherent|mixed THREADS MESH RAYS HITS
 *
 * Files are those of examples/trace_speed/files.rs; rays are traced in the order of their file, one by one and in
 * packets of 8 and 16. Answers are JSON, one line each, with milliseconds. At the end of stdin the hits of the
 * last way are written. */

#include <embree3/rtcore.h>
#include <immintrin.h>
#include <math.h>
#include <omp.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static struct { uint64_t vertices, facets; float *xyz; uint32_t *corners; } mesh;
static struct { uint64_t count; float *part[6]; } rays; /* origin and direction, each part by itself */
static struct { uint32_t *facet; float *range_m; } hits;
static enum RTCIntersectContextFlags order;

static void fail(const char *what, const char *which) {
    fprintf(stderr, "%s %s\n", what, which);
    exit(1);
}

static void *room(size_t bytes) {
    void *at = aligned_alloc(64, (bytes + 127) / 64 * 64);
    if (!at) fail("no room for", "the workload");
    memset(at, 0, (bytes + 127) / 64 * 64);
    return at;
}

static FILE *opened(const char *path, const char *mode) {
    FILE *file = fopen(path, mode);
    if (!file) fail("cannot open", path);
    return file;
}

static void take(void *to, size_t size, size_t count, FILE *file) {
    if (fread(to, size, count, file) != count) fail("a file", "ends too early");
}

static void read_mesh(const char *path) {
    FILE *file = opened(path, "rb");
    take(&mesh.vertices, 8, 1, file);
    take(&mesh.facets, 8, 1, file);
    /* Embree reads 16 bytes at the last vertex, too. */
    mesh.xyz = room(12 * mesh.vertices + 4);
    for (uint64_t i = 0; i < 3 * mesh.vertices; i++) {
        double value;
        take(&value, 8, 1, file);
        mesh.xyz[i] = (float)value;
    }
    mesh.corners = room(12 * mesh.facets);
    take(mesh.corners, 12, mesh.facets, file);
    fclose(file);
}

static void read_rays(const char *path) {
    FILE *file = opened(path, "rb");
    take(&rays.count, 8, 1, file);
    for (int part = 0; part < 6; part++) rays.part[part] = room(4 * (rays.count + 16));
    for (uint64_t i = 0; i < rays.count; i++) {
        double values[6];
        take(values, 8, 6, file);
        for (int part = 0; part < 6; part++) rays.part[part][i] = (float)values[part];
    }
    fclose(file);
}

static void write_hits(const char *path) {
    FILE *file = opened(path, "wb");
    fwrite(hits.facet, 4, rays.count, file);
    for (uint64_t i = 0; i < rays.count; i++) {
        double range_m = hits.range_m[i];
        fwrite(&range_m, 8, 1, file);
    }
    if (fclose(file)) fail("cannot write", path);
}

static RTCScene build(RTCDevice device, enum RTCBuildQuality quality, enum RTCSceneFlags flags) {
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneBuildQuality(scene, quality);
    rtcSetSceneFlags(scene, flags);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetGeometryBuildQuality(geometry, quality);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, mesh.xyz, 0, 12,
                               mesh.vertices);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.corners, 0, 12,
                               mesh.facets);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
    return scene;
}

static struct RTCIntersectContext context(void) {
    struct RTCIntersectContext made;
    rtcInitIntersectContext(&made);
    made.flags = order;
    return made;
}

static void trace1(RTCScene scene) {
#pragma omp parallel for schedule(dynamic, 1024)
    for (uint64_t i = 0; i < rays.count; i++) {
        struct RTCIntersectContext how = context();
        struct RTCRayHit one = {
            .ray = {.org_x = rays.part[0][i], .org_y = rays.part[1][i], .org_z = rays.part[2][i],
                    .dir_x = rays.part[3][i], .dir_y = rays.part[4][i], .dir_z = rays.part[5][i],
                    .tfar = INFINITY, .mask = -1},
            .hit = {.primID = RTC_INVALID_GEOMETRY_ID, .geomID = RTC_INVALID_GEOMETRY_ID}};
        rtcIntersect1(scene, &how, &one);
        hits.facet[i] = one.hit.primID;
        hits.range_m[i] = one.ray.tfar;
    }
}

#define TRACE(LANES)                                                                                          \
    static void trace##LANES(RTCScene scene) {                                                                \
        _Pragma("omp parallel for schedule(dynamic, 64)")                                                     \
        for (uint64_t first = 0; first < rays.count; first += LANES) {                                        \
            struct RTCIntersectContext how = context();                                                       \
            struct RTCRayHit##LANES many;                                                                     \
            _Alignas(64) int32_t valid[LANES];                                                                \
            memcpy(many.ray.org_x, rays.part[0] + first, 4 * LANES);                                          \
            memcpy(many.ray.org_y, rays.part[1] + first, 4 * LANES);                                          \
            memcpy(many.ray.org_z, rays.part[2] + first, 4 * LANES);                                          \
            memcpy(many.ray.dir_x, rays.part[3] + first, 4 * LANES);                                          \
            memcpy(many.ray.dir_y, rays.part[4] + first, 4 * LANES);                                          \
            memcpy(many.ray.dir_z, rays.part[5] + first, 4 * LANES);                                          \
            for (int lane = 0; lane < LANES; lane++) {                                                        \
                valid[lane] = first + lane < rays.count ? -1 : 0;                                             \
                many.ray.tnear[lane] = many.ray.time[lane] = 0;                                               \
                many.ray.tfar[lane] = INFINITY;                                                               \
                many.ray.mask[lane] = -1;                                                                     \
                many.hit.primID[lane] = many.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;                      \
            }                                                                                                 \
            rtcIntersect##LANES(valid, scene, &how, &many);                                                   \
            memcpy(hits.facet + first, many.hit.primID, 4 * LANES);                                           \
            memcpy(hits.range_m + first, many.ray.tfar, 4 * LANES);                                           \
        }                                                                                                     \
    }
TRACE(8)
TRACE(16)

static double now_ms(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e3 * now.tv_sec + 1e-6 * now.tv_nsec;
}

int main(int count, char **words) {
    if (count != 8) fail("the head of embree.c tells", "the arguments");
    enum RTCBuildQuality quality = words[1][0] == 'l' ? RTC_BUILD_QUALITY_LOW : RTC_BUILD_QUALITY_MEDIUM;
    enum RTCSceneFlags flags = words[2][0] == 'r' ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE;
    int coherent = words[3][0] == 'c';
    order = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    omp_set_num_threads(atoi(words[4]));
    /* Denormal numbers as zero, as its manual wants it. */
#pragma omp parallel
    _mm_setcsr(_mm_getcsr() | 0x8040);
    read_mesh(words[5]);
    read_rays(words[6]);
    hits.facet = room(4 * (rays.count + 16));
    hits.range_m = room(4 * (rays.count + 16));

    char settings[64];
    snprintf(settings, sizeof settings, "threads=%s,set_affinity=0", words[4]);
    RTCDevice device = rtcNewDevice(settings);
    if (!device) fail("no Embree for", settings);
    printf("ready {\"version\": \"%s\", \"lanes16\": %ld}\n", RTC_VERSION_STRING,
           (long)rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED));
    fflush(stdout);

    char line[16];
    while (fgets(line, sizeof line, stdin)) {
        double t0 = now_ms();
        RTCScene scene = build(device, quality, flags);
        double t1 = now_ms();
        trace1(scene);
        double t2 = now_ms();
        trace8(scene);
        double t3 = now_ms();
        trace16(scene);
        double t4 = now_ms();
        rtcReleaseScene(scene);
        printf("{\"build\": %.6f, \"traces\": {\"single\": %.6f, \"packets of 8\": %.6f, "
               "\"packets of 16\": %.6f}}\n", t1 - t0, t2 - t1, t3 - t2, t4 - t3);
        fflush(stdout);
    }
    write_hits(words[7]);
    rtcReleaseDevice(device);
    return 0;
}
